#include "calibrate/formats_rig.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <opencv2/core/persistence.hpp>
#include <random>

#include "geometry/lens.h"
#include "settings/rig_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace {

using testing::HasSubstr;

constexpr double kExact = 1e-9;  // as the contract for round trips says: m, px and no unit alike

// Cameras of both kinds anywhere, with turns up to and near half a turn, and names that need quotes.
Rig random_rig(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Rig rig;
  for (int i = 0; i < 6; ++i) {
    CameraModel camera;
    camera.name = i == 0 ? "north-east" : i == 1 ? "door: \"left\", #2" : "camera" + std::to_string(i);
    camera.width_px = 1280 + i;
    camera.height_px = 1024 - i;
    camera.lens.kind = i % 2 == 0 ? LensKind::Pinhole : LensKind::Fisheye;
    camera.lens.fx_px = 1000.0 + 300.0 * unit(random);
    camera.lens.fy_px = 1000.0 + 300.0 * unit(random);
    camera.lens.cx_px = 640.0 + 30.0 * unit(random);
    camera.lens.cy_px = 512.0 + 30.0 * unit(random);
    for (int k = 0; k < (i % 2 == 0 ? 5 : 4); ++k) camera.lens.distortion[k] = 0.3 * unit(random);
    const Eigen::Vector3d axis = Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
    const double angle = i == 2 ? 3.14159265358979 : i == 3 ? 1e-9 : 3.0 * unit(random);
    camera.camera_from_world.rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    camera.camera_from_world.translation = 5.0 * Eigen::Vector3d(unit(random), unit(random), unit(random));
    rig.push_back(camera);
  }
  return rig;
}

void expect_same(const Rig& found, const Rig& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t c = 0; c < found.size(); ++c) {
    SCOPED_TRACE(expected[c].name);
    EXPECT_EQ(found[c].name, expected[c].name);
    EXPECT_EQ(found[c].width_px, expected[c].width_px);
    EXPECT_EQ(found[c].height_px, expected[c].height_px);
    const Lens& a = found[c].lens;
    const Lens& b = expected[c].lens;
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_NEAR(a.fx_px, b.fx_px, kExact);
    EXPECT_NEAR(a.fy_px, b.fy_px, kExact);
    EXPECT_NEAR(a.cx_px, b.cx_px, kExact);
    EXPECT_NEAR(a.cy_px, b.cy_px, kExact);
    EXPECT_LT((a.distortion - b.distortion).cwiseAbs().maxCoeff(), kExact);
    const auto& p = found[c].camera_from_world;
    const auto& q = expected[c].camera_from_world;
    EXPECT_LT((p.rotation - q.rotation).cwiseAbs().maxCoeff(), kExact);
    EXPECT_LT((p.translation - q.translation).cwiseAbs().maxCoeff(), kExact);
  }
}

class Formats : public testing::Test {
 protected:
  std::string faults_of(const std::string& file, const std::string& text, std::optional<RigFormat> format = {}) {
    const auto read = read_rig(folder_.write(file, text), format);
    if (read) return "";
    std::string all;
    for (const auto& fault : read.error().list) all += settings::to_text(fault) + "\n";
    return all;
  }

  support::TemporaryFolder folder_;
};

TEST_F(Formats, OfEveryKindGiveTheSameRigBack) {
  for (const RigFormat format : {RigFormat::OpenCv, RigFormat::Kalibr, RigFormat::Pose2Sim}) {
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(std::string(name_of(format)) + " seed " + std::to_string(seed));
      const Rig rig = random_rig(seed);

      const auto written = rig_text(rig, format);
      ASSERT_TRUE(written) << written.error().message;
      const auto read = read_rig(folder_.write("rig", written->text), std::nullopt);  // told by what it says

      ASSERT_TRUE(read) << settings::to_text(read.error());
      expect_same(read->rig, rig);
    }
  }
}

TEST_F(Formats, OpenCvItselfReadsWhatIsWritten) {
  const Rig rig = random_rig(7);
  const auto path = folder_.write("rig.yml", rig_text(rig, RigFormat::OpenCv)->text);

  const cv::FileStorage file(path.string(), cv::FileStorage::READ);

  ASSERT_TRUE(file.isOpened());
  const cv::FileNode cameras = file["cameras"];
  ASSERT_EQ(cameras.size(), rig.size());
  for (int c = 0; c < static_cast<int>(rig.size()); ++c) {
    const CameraModel& camera = rig[static_cast<std::size_t>(c)];
    EXPECT_EQ(static_cast<std::string>(cameras[c]["name"]), camera.name);
    EXPECT_EQ(static_cast<int>(cameras[c]["image_width"]), camera.width_px);
    cv::Mat matrix;
    cv::Mat rotation;
    cv::Mat distortion;
    cameras[c]["camera_matrix"] >> matrix;
    cameras[c]["rotation"] >> rotation;
    cameras[c]["distortion_coefficients"] >> distortion;
    EXPECT_EQ(matrix.at<double>(1, 1), camera.lens.fy_px);
    EXPECT_EQ(rotation.at<double>(2, 1), camera.camera_from_world.rotation(2, 1));
    EXPECT_EQ(distortion.at<double>(3), camera.lens.distortion[3]);
  }
}

TEST_F(Formats, ReadWhatOpenCvItselfWrites) {
  const cv::Matx33d matrix(801.25, 0.0, 319.5, 0.0, 799.75, 239.25, 0.0, 0.0, 1.0);
  const std::vector<double> distortion{-0.1, 0.02, 1e-4, -2e-4, 0.003};
  {
    cv::FileStorage file((folder_.path() / "door.yml").string(), cv::FileStorage::WRITE);
    file << "calibration_time"
         << "Sat"
         << "image_width" << 640 << "image_height" << 480;
    file << "camera_matrix" << cv::Mat(matrix) << "distortion_coefficients" << cv::Mat(distortion);
    file << "avg_reprojection_error" << 0.1;
  }

  const auto read = read_rig(folder_.path() / "door.yml", std::nullopt);

  ASSERT_TRUE(read) << settings::to_text(read.error());
  ASSERT_EQ(read->rig.size(), 1u);
  EXPECT_EQ(read->rig[0].name, "door");  // the file's own name: it tells no other
  EXPECT_EQ(read->rig[0].lens.fx_px, 801.25);
  EXPECT_EQ(read->rig[0].lens.distortion[4], 0.003);
  EXPECT_THAT(read->notices, testing::Contains(HasSubstr("does not say where it stands")));
}

// The example of Kalibr's wiki, shortened.
constexpr const char* kChain = R"(cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  distortion_model: radtan
  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]
  rostopic: /left/image_raw
  resolution: [752, 480]
cam1:
  camera_model: pinhole
  intrinsics: [460.5, 459.25, 376.5, 240.25]
  distortion_model: equidistant
  distortion_coeffs: [0.01, 0.02, -0.03, 0.004]
  T_cn_cnm1:
  - [0.0, -1.0, 0.0, -0.11]
  - [1.0, 0.0, 0.0, 0.02]
  - [0.0, 0.0, 1.0, 0.03]
  - [0.0, 0.0, 0.0, 1.0]
  rostopic: /right/image_raw
  resolution: [752, 480]
)";

TEST_F(Formats, AKalibrChainIsFromEachCameraToTheNext) {
  const auto read = read_rig(folder_.write("camchain.yaml", kChain), std::nullopt);

  ASSERT_TRUE(read) << settings::to_text(read.error());
  ASSERT_EQ(read->rig.size(), 2u);
  EXPECT_EQ(read->rig[0].name, "left");
  EXPECT_EQ(read->rig[1].name, "right");
  EXPECT_EQ(read->rig[1].lens.kind, LensKind::Fisheye);
  const CameraPoint seen = read->rig[1].camera_from_world * WorldPoint{{1.0, 2.0, 3.0}};
  EXPECT_LT((seen.v - Eigen::Vector3d(-2.0 - 0.11, 1.0 + 0.02, 3.03)).norm(), 1e-12);
}

TEST_F(Formats, FaultsNameLineAndValue) {
  std::string chain = kChain;
  chain.replace(chain.find("0.06712482"), 10, "nan");
  EXPECT_THAT(faults_of("a.yaml", chain),
              HasSubstr("a.yaml:5:36: camera 'left': distortion_coeffs has 'nan', expected"));

  chain = kChain;
  chain.replace(chain.find("[0.0, -1.0"), 10, "[0.5, -1.0");
  EXPECT_THAT(faults_of("b.yaml", chain), HasSubstr("camera 'right': its rotation is none: R R^T is 0.5"));

  chain = kChain;
  chain.replace(chain.find("[0.0, -1.0"), 10, "[0.0, +1.0");
  EXPECT_THAT(faults_of("c.yaml", chain), HasSubstr("the world is mirrored"));

  chain = kChain;
  chain.replace(chain.find("camera_model: pinhole"), 21, "camera_model: omni");
  chain.replace(chain.find("[752, 480]"), 10, "[752, 0]");
  EXPECT_THAT(faults_of("d.yaml", chain), HasSubstr("d.yaml:2:17: camera 'left': camera_model is 'omni', expected"));

  EXPECT_THAT(faults_of("e.yaml", "cam0: [1, 2\n", RigFormat::Kalibr), HasSubstr("is no YAML"));
  EXPECT_THAT(faults_of("f.yaml", "hello"), HasSubstr("say --format"));
  EXPECT_THAT(faults_of("g.txt", "<calibration><cameras><camera serial='1'></cameras>"),
              HasSubstr("g.txt:1:51: is no XML that could be read: it </cameras> closes <camera>"));
}

TEST_F(Formats, AliasesThatExplodeAreRefused) {
  std::string bomb = "camera_model: a\nintrinsics: b\na0: &a0 [x,x,x,x,x,x,x,x,x,x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += (k ? ", " : "") + before;
    bomb += "]\n";
  }
  EXPECT_THAT(faults_of("bomb.yaml", bomb), HasSubstr("larger than a calibration can be"));
}

TEST_F(Formats, LensesThatWeDoNotHaveAreRefused) {
  const std::string text =
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 800., 0.5, 320., 0., 800., 240., 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 8\n   cols: 1\n   dt: d\n"
      "   data: [ 0.1, 0., 0., 0., 0., 0.25, 0., 0. ]\n";
  const std::string faults = faults_of("rational.yml", text);
  EXPECT_THAT(faults, HasSubstr("camera_matrix has a skew of 0.5, expected 0"));
  EXPECT_THAT(faults, HasSubstr("distortion_coefficients has 0.25 as its number 6, expected 0"));
}

TEST(ForeignRig, OfPose2SimWithKeysThatWeDoNotKnowIsReadAndTold) {
  const support::TemporaryFolder folder;
  std::string text = rig_text(random_rig(11), RigFormat::Pose2Sim)->text;
  text.insert(text.find("size ="), "cam_id = 3\nerror = 0.2\n");
  text += "\n[charuco]\ncolumns = 8\n";
  const auto file = folder.write("Calib.toml", text);

  const auto read = read_rig(file, RigFormat::Pose2Sim);

  ASSERT_TRUE(read) << settings::to_text(read.error());
  expect_same(read->rig, random_rig(11));
  ASSERT_EQ(read->notices.size(), 3u);
  EXPECT_THAT(read->notices[0], HasSubstr("[cam_01] has 'cam_id', which a rig has no place for"));
  EXPECT_THAT(read->notices[2], HasSubstr("[charuco] is no camera"));
}

TEST(QcaFile, APointProjectedByHandAgrees) {
  const std::filesystem::path path = std::filesystem::path(support::shared_data_folder()) / "multiview/Calib.qca.txt";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";

  const auto read = read_rig(path, std::nullopt);

  ASSERT_TRUE(read) << settings::to_text(read.error());
  ASSERT_EQ(read->rig.size(), 4u);
  const CameraModel& camera = read->rig[0];
  EXPECT_EQ(camera.name, "cam01");
  EXPECT_EQ(camera.width_px, 1088);
  EXPECT_EQ(camera.height_px, 1920);
  // By hand, from the file's numbers in its own units: mm and 64ths of a pixel; y up, looking along -z.
  const double p[3] = {100.0, -200.0, 1000.0};
  const double d[3] = {p[0] - 1460.2323709212087, p[1] + 1909.1590482454608, p[2] - 1896.5058524092062};
  const double right = 0.5536380477336265 * d[0] + 0.8046719867383512 * d[1] + 0.2144479094331626 * d[2];
  const double up = -0.4345300743838753 * d[0] + 0.05946489349975602 * d[1] + 0.8986921279821063 * d[2];
  const double back = 0.7104002579937896 * d[0] - 0.5907342212870501 * d[1] + 0.3825762057979294 * d[2];
  const double x = right / -back;
  const double y = -up / -back;
  const double r2 = x * x + y * y;
  const double bend = 1.0 - 0.046183 * r2 + 0.139983 * r2 * r2;
  const double bent_x = x * bend + 2.0 * 0.000608 * x * y + 0.00069 * (r2 + 2.0 * x * x);
  const double bent_y = y * bend + 0.000608 * (r2 + 2.0 * y * y) + 2.0 * 0.00069 * x * y;
  const double u = (107599.671875 * bent_x + 34110.316406) / 64.0;
  const double v = (107588.828125 * bent_y + 60680.792969) / 64.0;

  const auto seen = geometry::project(camera, WorldPoint{{0.1, -0.2, 1.0}});

  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->v.x(), u, 1e-6);
  EXPECT_NEAR(seen->v.y(), v, 1e-6);
}

TEST(QcaFile, ItsCamerasLookAtOneVolumeFromAbove) {
  const std::filesystem::path path = std::filesystem::path(support::shared_data_folder()) / "multiview/Calib.qca.txt";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const auto read = read_rig(path, RigFormat::Qca);
  ASSERT_TRUE(read);
  for (const CameraModel& camera : read->rig) {
    EXPECT_GT(camera.centre().v.z(), 1.0) << camera.name;  // m
    const auto middle = geometry::project(camera, WorldPoint{{0.0, 0.0, 1.0}});
    ASSERT_TRUE(middle) << camera.name;
    EXPECT_TRUE(geometry::in_image(camera, *middle)) << camera.name;
    const auto above = geometry::project(camera, WorldPoint{{0.0, 0.0, 1.5}});
    EXPECT_LT(above->v.y(), middle->v.y()) << camera.name;
  }
}

}  // namespace
}  // namespace mocap::calibrate
