#include "settings/rig/rig_file.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <fstream>
#include <numbers>
#include <random>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace rig_file_test {

using testing::HasSubstr;

// A rig in the format of Pose2Sim: sizes are floats, four distortions, a table name that is not the camera's name.
constexpr const char* kFromPose2Sim = R"([cam_01]
name = "M11139"
size = [ 1920.0, 1080.0]
matrix = [ [ 1237.0284, 0.0, 951.8050], [ 0.0, 1239.2593, 545.5284], [ 0.0, 0.0, 1.0]]
distortions = [ -0.13060, 0.13401, 0.00018962, -0.0010206]
rotation = [ 0.96185615, 1.52944835, 0.52421935]
translation = [ -0.62705257, -0.48604618, 1.66481352]
fisheye = false

[metadata]
adjusted = false
error = 0.0
)";

class RigFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) { return folder_.write("rig.toml", text); }

  /// The example with `from` replaced.
  std::filesystem::path write_with(const std::string& from, const std::string& to) {
    std::string text = kFromPose2Sim;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return write(text.replace(at, from.size(), to));
  }

  std::string faults_of(const std::filesystem::path& path) {
    const auto rig = load_rig(path);
    return rig ? "" : to_text(rig.error());
  }

  support::TemporaryFolder folder_;
};

CameraModel random_camera(std::mt19937& random, const std::string& name, double angle) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  CameraModel camera;
  camera.name = name;
  camera.width_px = 1280;
  camera.height_px = 1024;
  camera.lens.fx_px = 1000.0 + unit(random);
  camera.lens.fy_px = 1001.0 + unit(random);
  camera.lens.cx_px = 640.0 + unit(random);
  camera.lens.cy_px = 512.0 + unit(random);
  for (double& k : camera.lens.distortion) k = 0.1 * unit(random);
  const Eigen::Vector3d axis = Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
  camera.camera_from_world.rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  camera.camera_from_world.translation = {5.0 * unit(random), 5.0 * unit(random), 5.0 * unit(random)};
  return camera;
}

void expect_same_masks(const std::vector<MaskPolygon>& found, const std::vector<MaskPolygon>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(found[i].size(), expected[i].size());
    for (std::size_t k = 0; k < expected[i].size(); ++k) EXPECT_EQ(found[i][k].v, expected[i][k].v);
  }
}

TEST_F(RigFile, OfAnotherProgramIsReadCompletely) {
  const auto rig = load_rig(write(kFromPose2Sim));

  ASSERT_TRUE(rig) << to_text(rig.error());
  ASSERT_EQ(rig->size(), 1U);
  const CameraModel& camera = rig->front();
  EXPECT_EQ(camera.name, "M11139");
  EXPECT_EQ(camera.width_px, 1920);
  EXPECT_EQ(camera.height_px, 1080);
  EXPECT_EQ(camera.lens.fy_px, 1239.2593);
  EXPECT_EQ(camera.lens.cx_px, 951.8050);
  EXPECT_EQ(camera.lens.distortion[3], -0.0010206);
  EXPECT_EQ(camera.lens.distortion[4], 0.0);
  EXPECT_EQ(camera.camera_from_world.translation.z(), 1.66481352);
}

TEST_F(RigFile, ReadsItsRotationAsARodriguesVector) {
  // A rotation of 90 degrees about x maps y to z.
  const auto rig = load_rig(write_with("[ 0.96185615, 1.52944835, 0.52421935]", "[1.5707963267948966, 0, 0]"));

  ASSERT_TRUE(rig) << to_text(rig.error());
  const Eigen::Vector3d turned = rig->front().camera_from_world.rotation * Eigen::Vector3d::UnitY();
  EXPECT_LT((turned - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
}

TEST_F(RigFile, ReadsBackAsItWasSaved) {
  std::mt19937 random(7);
  Rig rig;
  // Also angles of 0, nearly 0, 180 and nearly 180 degrees, where rotation vectors lose digits.
  const double pi = std::numbers::pi;
  for (const double angle : {0.0, 1e-9, 0.3, 1.7, pi - 1e-9, pi}) {
    rig.push_back(random_camera(random, "north-east \"" + std::to_string(rig.size()) + "\" \\ \xc3\xbc", angle));
  }
  rig[2].lens.kind = LensKind::Fisheye;
  rig[2].lens.distortion[4] = 0.0;
  const std::filesystem::path path = folder_.path() / "rig.toml";

  ASSERT_TRUE(save_rig(path, rig, {{"error", 0.25}, {"adjusted", true}, {"solver", std::string("bundle")}}));
  const auto again = load_rig(path);

  ASSERT_TRUE(again) << to_text(again.error());
  ASSERT_EQ(again->size(), rig.size());
  for (std::size_t i = 0; i < rig.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_EQ((*again)[i].name, rig[i].name);
    EXPECT_EQ((*again)[i].lens.kind, rig[i].lens.kind);
    EXPECT_EQ((*again)[i].lens.fx_px, rig[i].lens.fx_px);  // the shortest text that reads back as the same bits
    EXPECT_EQ((*again)[i].lens.distortion, rig[i].lens.distortion);
    EXPECT_EQ((*again)[i].camera_from_world.translation, rig[i].camera_from_world.translation);
    // The rounding of a few operations on numbers near 1.
    EXPECT_LT(((*again)[i].camera_from_world.rotation - rig[i].camera_from_world.rotation).cwiseAbs().maxCoeff(),
              1e-12);
  }
}

TEST_F(RigFile, IsReplacedAsAWholeOrNotAtAll) {
  std::mt19937 random(7);
  const Rig rig{random_camera(random, "a", 0.3)};
  const std::filesystem::path path = write("old");

  EXPECT_FALSE(save_rig(folder_.path() / "no-such-folder" / "rig.toml", rig, {}));
  ASSERT_TRUE(save_rig(path, rig, {}));

  EXPECT_TRUE(load_rig(path));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), {}), 1) << "a temporary file was left";
}

struct BadRig {
  const char* from;
  const char* to;
  const char* fault;  ///< and its place
};

class BadRigFile : public RigFile, public testing::WithParamInterface<BadRig> {};

TEST_P(BadRigFile, HasAFaultWithPlaceAndExpectation) {
  const auto path = write_with(GetParam().from, GetParam().to);

  EXPECT_THAT(faults_of(path), HasSubstr(GetParam().fault));
}

INSTANTIATE_TEST_SUITE_P(
    Each, BadRigFile,
    testing::Values(
        BadRig{"1237.0284", "0.0", ":4:10: camera 'M11139': focal length is [0, 1239.2593] px, expected more than 0"},
        BadRig{"1239.2593", "-3", ":4:10: camera 'M11139': focal length is [1237.0284, -3] px, expected more than 0"},
        BadRig{"[ 0.0, 0.0, 1.0]]", "[ 0.0, 0.0]]",
               ":4:70: camera 'M11139': matrix has a list of 2 as a row, expected 3"},
        BadRig{"[ 0.0, 0.0, 1.0]]", "[0,0,2]]", "camera 'M11139': last row of matrix is [0, 0, 2], expected [0, 0, 1]"},
        BadRig{"1237.0284, 0.0", "1237.0284, 0.5", "camera 'M11139': matrix has a skew of 0.5, expected 0"},
        BadRig{"951.8050", "nan", ":4:30: camera 'M11139': matrix has nan, expected finite numbers"},
        BadRig{"[ 1920.0, 1080.0]", "[1920]",
               ":3:8: camera 'M11139': size is a list of 1, expected a list of 2 numbers"},
        BadRig{"1920.0", "1920.5", ":3:8: camera 'M11139': size is [1920.5, 1080], expected whole px, 1 to 16384"},
        BadRig{"1080.0", "0", "camera 'M11139': size is [1920, 0], expected whole px"},
        BadRig{", -0.0010206", "",
               ":5:15: camera 'M11139': distortions is a list of 3, expected a list of 4 or 5 numbers"},
        BadRig{"0.96185615", "inf", ":6:14: camera 'M11139': rotation has inf, expected finite numbers"},
        BadRig{"[ 0.96185615, 1.52944835, 0.52421935]", "[[1,0,0],[0,1,0],[0,0,1.1]]", "matrix is no rotation"},
        BadRig{"[ 0.96185615, 1.52944835, 0.52421935]", "[[1,0,0],[0,1,0],[0,0,-1]]", "determinant -1"},
        BadRig{"translation", "translaton",
               ":7:1: camera 'M11139': unknown key 'translaton', did you mean 'translation'? Expected [x, y, z] in m"},
        BadRig{"translation", "offset", ":1:1: camera 'M11139': translation is missing, expected [x, y, z] in m"},
        BadRig{"fisheye = false", "fisheye = 0", ":8:11: camera 'M11139': fisheye is 0, expected true or false"},
        BadRig{"fisheye = false", "mask = [[1, 2], [3, 4], [5, 6]]",
               ":8:9: camera 'M11139': mask has a list of 2 as a polygon, expected a list of at least 3 corners"},
        BadRig{
            "fisheye = false", "mask = [[[1, 2], [3, 4], [5, nan]]]",
            ":8:26: camera 'M11139': mask has a list of 2 as a corner, expected [x, y], px, each -1000000 to 1000000"},
        BadRig{"fisheye = false", "mask = true", ":8:8: camera 'M11139': mask is true, expected a list of polygons"},
        BadRig{"[metadata]", "[cam_02]\nname = \"M11139\"\n[metadata]", "camera 'M11139': is in this rig twice"},
        BadRig{
            "[ 0.96185615, 1.52944835, 0.52421935]", "[55.1, 87.6, 30.0]",
            ":6:12: camera 'M11139': rotation [55.1, 87.6, 30] has an angle of 107.749 rad, expected 0 to pi; it looks "
            "like degrees: multiply by pi / 180"},
        BadRig{"[ -0.62705257, -0.48604618, 1.66481352]", "[-627.1, -486.0, 1664.8]",
               ":7:15: camera 'M11139': the camera is 1844.18 m from the origin, expected at most 1000 m; translation "
               "looks like millimetres: divide by 1000"},
        BadRig{"1237.0284", "6.2",
               ":4:10: camera 'M11139': focal length of 6.2 px gives an opening angle of 179.3 "
               "degrees, expected 5 to 170; the focal length looks like millimetres"},
        BadRig{"951.8050", "4000",
               ":4:10: camera 'M11139': principal point is [4000, 545.528] px, expected x -960 to "
               "2880"},
        BadRig{"[metadata]", "[metadata", ":10:10: "}),
    [](const auto& bad) { return "Case" + std::to_string(bad.index); });

TEST_F(RigFile, ReadsTheMasksOfACamera) {
  const auto rig = load_rig(write_with("fisheye = false", R"(fisheye = false
mask = [[[10, 20.5], [30, 20], [30, 40]], [[0, 0], [5, 0], [5, 5], [0, 5]]]
mask_learnt = [[[100.0, 100.0], [110.0, 100.0], [105.0, 108.0]]])"));

  ASSERT_TRUE(rig) << to_text(rig.error());
  const CameraModel& camera = rig->front();
  ASSERT_EQ(camera.masks.size(), 2U);
  EXPECT_EQ(camera.masks[0].size(), 3U);
  EXPECT_EQ(camera.masks[0][0].v, Eigen::Vector2d(10.0, 20.5));
  EXPECT_EQ(camera.masks[1].size(), 4U);
  ASSERT_EQ(camera.learnt_masks.size(), 1U);
  EXPECT_EQ(camera.learnt_masks[0][2].v, Eigen::Vector2d(105.0, 108.0));
}

TEST_F(RigFile, KeepsItsMasksWhenItIsWritten) {
  std::mt19937 random(11);
  Rig rig{random_camera(random, "a", 0.3), random_camera(random, "b", 0.4)};
  rig[0].masks = {{{{0.1, 2.0}}, {{3.0, 4.0}}, {{5.5, 1.0 / 3.0}}}, {{{-9.0, 0.0}}, {{1.0, 0.0}}, {{1.0, 9.0}}}};
  rig[1].learnt_masks = {{{{7.0, 2.0}}, {{3.0, 4.0}}, {{5.5, 6.0}}, {{5.5, 1.0}}}};
  const std::filesystem::path path = folder_.path() / "masked.toml";

  ASSERT_TRUE(save_rig(path, rig, {}));
  const auto again = load_rig(path);

  ASSERT_TRUE(again) << to_text(again.error());
  for (std::size_t i = 0; i < rig.size(); ++i) {
    expect_same_masks((*again)[i].masks, rig[i].masks);
    expect_same_masks((*again)[i].learnt_masks, rig[i].learnt_masks);
  }
}

TEST_F(RigFile, HasNoCameraNamedMetadata) {
  std::mt19937 random(3);
  const auto path = folder_.path() / "own.toml";

  const Status saved = save_rig(path, {random_camera(random, "metadata", 0.3)}, {});

  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(saved.error().message, HasSubstr("a camera is named 'metadata'"));
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THAT(faults_of(write_with("M11139", "metadata")),
              HasSubstr("rig.toml:2:8: camera 'cam_01': name is 'metadata'"));
}

TEST_F(RigFile, SaysWhetherItsFloorIsGuessed) {
  EXPECT_TRUE(floor_is_guessed(write_with("adjusted = false", "floor = \"guessed\"")));
  EXPECT_FALSE(floor_is_guessed(write_with("adjusted = false", "floor = \"frame\"")));
  EXPECT_FALSE(floor_is_guessed(write_with("adjusted = false", "floor = 1")));
  EXPECT_FALSE(floor_is_guessed(write(kFromPose2Sim)));
  EXPECT_FALSE(floor_is_guessed(folder_.path() / "none.toml"));
}

TEST_F(RigFile, WithoutACameraIsAFault) {
  EXPECT_THAT(faults_of(write("[metadata]\nerror = 1.0\n")), HasSubstr("no camera in this rig"));
}

TEST_F(RigFile, ThatDoesNotExistIsAFault) {
  EXPECT_EQ(faults_of("/nowhere/rig.toml"),
            "/nowhere/rig.toml: no such file\n/nowhere/rig.toml: 1 fault, nothing started");
}

TEST_F(RigFile, ListsAllFaultsAtOnce) {
  const std::string faults = faults_of(write("[a]\nsize = [0, 1]\n[b]\nmatrix = 3\n"));

  // a: size, matrix, rotation, translation; b: size, matrix, rotation, translation.
  EXPECT_THAT(faults, HasSubstr(": 8 faults, nothing started"));
}

}  // namespace rig_file_test
}  // namespace mocap::settings
