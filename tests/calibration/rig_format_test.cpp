#include "calibration/formats/rig_format.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core/persistence.hpp>

#include "calibration/formats/format_reader.h"
#include "calibration/formats/yaml_camera.h"
#include "geometry/lens.h"
#include "support/places.h"
#include "support/random_rig.h"
#include "support/temporary_folder.h"

namespace mocap::calibration {
namespace rig_format_test {

using support::expect_same_rig;
using support::random_rig;
using testing::HasSubstr;

std::string text_of(const FormatFaults& faults) {
  std::string all;
  for (const FormatFault& fault : faults)
    all += std::to_string(fault.line) + ":" + std::to_string(fault.column) + ": " + fault.message + "\n";
  return all;
}

// Parses in the format that the content suggests.
Result<ParsedRig, FormatFaults> parse(const std::string& text, const std::string& default_name = "camera") {
  const auto format = guess_format(text);
  if (!format) return FormatFaults{{0, 0, "unknown format"}};
  return parse_rig(*format, text, default_name);
}

std::string faults_of(const std::string& text) {
  const auto parsed = parse(text);
  return parsed ? "" : text_of(parsed.error());
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(RigFormat, ParsesTheRigThatIsWritten) {
  for (const RigFormat format : {RigFormat::OpenCv, RigFormat::Kalibr}) {
    for (std::uint32_t seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(std::string(name_of(format)) + " seed " + std::to_string(seed));
      const Rig rig = random_rig(seed);

      const auto written = rig_text(rig, format);
      ASSERT_TRUE(written) << written.error().message;
      const auto parsed = parse(written->text);

      ASSERT_TRUE(parsed) << text_of(parsed.error());
      expect_same_rig(parsed->rig, rig);
    }
  }
}

TEST(RigFormat, OpenCvReadsTheRigThatIsWritten) {
  const support::TemporaryFolder folder;
  const Rig rig = random_rig(7);
  const auto path = folder.write("rig.yml", rig_text(rig, RigFormat::OpenCv)->text);

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

TEST(RigFormat, ParsesAFileThatOpenCvWrites) {
  const support::TemporaryFolder folder;
  const cv::Matx33d matrix(801.25, 0.0, 319.5, 0.0, 799.75, 239.25, 0.0, 0.0, 1.0);
  const std::vector<double> distortion{-0.1, 0.02, 1e-4, -2e-4, 0.003};
  {
    cv::FileStorage file((folder.path() / "door.yml").string(), cv::FileStorage::WRITE);
    file << "calibration_time"
         << "Sat"
         << "image_width" << 640 << "image_height" << 480;
    file << "camera_matrix" << cv::Mat(matrix) << "distortion_coefficients" << cv::Mat(distortion);
    file << "avg_reprojection_error" << 0.1;
  }

  const auto parsed = parse(read(folder.path() / "door.yml"), "door");

  ASSERT_TRUE(parsed) << text_of(parsed.error());
  ASSERT_EQ(parsed->rig.size(), 1u);
  EXPECT_EQ(parsed->rig[0].name, "door");  // the default name: the file has none
  EXPECT_EQ(parsed->rig[0].lens.fx_px, 801.25);
  EXPECT_EQ(parsed->rig[0].lens.distortion[4], 0.003);
  EXPECT_THAT(parsed->notices, testing::Contains(HasSubstr("has no pose")));
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

TEST(RigFormat, AKalibrChainTransformsFromEachCameraToTheNext) {
  const auto parsed = parse(kChain);

  ASSERT_TRUE(parsed) << text_of(parsed.error());
  ASSERT_EQ(parsed->rig.size(), 2u);
  EXPECT_EQ(parsed->rig[0].name, "left");
  EXPECT_EQ(parsed->rig[1].name, "right");
  EXPECT_EQ(parsed->rig[1].lens.kind, LensKind::Fisheye);
  const CameraPoint seen = parsed->rig[1].camera_from_world * WorldPoint{{1.0, 2.0, 3.0}};
  EXPECT_LT((seen.v - Eigen::Vector3d(-2.0 - 0.11, 1.0 + 0.02, 3.03)).norm(), 1e-12);
}

TEST(RigFormat, FaultsNameLineAndValue) {
  std::string chain = kChain;
  chain.replace(chain.find("0.06712482"), 10, "nan");
  EXPECT_THAT(faults_of(chain), HasSubstr("5:36: camera 'left': distortion_coeffs has 'nan', expected"));

  chain = kChain;
  chain.replace(chain.find("[0.0, -1.0"), 10, "[0.5, -1.0");
  EXPECT_THAT(faults_of(chain),
              HasSubstr("camera 'right': rotation is not orthonormal: R R^T differs from the identity by 0.5"));

  chain = kChain;
  chain.replace(chain.find("[0.0, -1.0"), 10, "[0.0, +1.0");
  EXPECT_THAT(faults_of(chain), HasSubstr("the world is mirrored"));

  chain = kChain;
  chain.replace(chain.find("camera_model: pinhole"), 21, "camera_model: omni");
  chain.replace(chain.find("[752, 480]"), 10, "[752, 0]");
  EXPECT_THAT(faults_of(chain), HasSubstr("2:17: camera 'left': camera_model is 'omni', expected"));

  EXPECT_THAT(text_of(parse_rig(RigFormat::Kalibr, "cam0: [1, 2\n", "").error()), HasSubstr("is not YAML"));
  EXPECT_THAT(faults_of("<calibration><cameras><camera serial='1'></cameras>"),
              HasSubstr("1:51: is not readable XML: it has </cameras> where <camera> ends"));
}

TEST(RigFormat, RefusesAKalibrChainWithAGap) {
  std::string chain = kChain;
  chain.replace(chain.find("cam1:"), 5, "cam2:");

  EXPECT_THAT(faults_of(chain), HasSubstr("9:3: "));
  EXPECT_THAT(faults_of(chain), HasSubstr("has cam2, but no cam1: expected cam0, cam1, ... without a gap"));
}

TEST(RigFormat, NamesTheTablesOfAnOpenCvFileThatAreNoCamera) {
  const std::string left =
      "left:\n  camera_matrix: [[900, 0, 640], [0, 900, 512], [0, 0, 1]]\n  image_size: [1280, 1024]\n"
      "  rvec: [0, 0, 0.1]\n  tvec: [0, 0, 4]\n";

  const auto with_board = parse_rig(RigFormat::OpenCv, left + "board:\n  columns: 9\n", "camera");
  const auto with_camera = parse_rig(
      RigFormat::OpenCv,
      left + "right:\n  mtx: [[900, 0, 640], [0, 900, 512], [0, 0, 1]]\n  dist_coeffs: [0, 0, 0, 0]\n", "camera");

  ASSERT_TRUE(with_board) << text_of(with_board.error());
  EXPECT_THAT(with_board->notices, testing::Contains(HasSubstr("'board' is left out")));
  ASSERT_FALSE(with_camera);
  EXPECT_THAT(text_of(with_camera.error()), HasSubstr("camera 'right': has no camera_matrix"));
}

TEST(RigFormat, RefusesAliasesThatExpandToAHugeTree) {
  std::string bomb = "camera_model: a\nintrinsics: b\na0: &a0 [x,x,x,x,x,x,x,x,x,x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [";
    for (int k = 0; k < 10; ++k) bomb += (k ? ", " : "") + before;
    bomb += "]\n";
  }
  EXPECT_THAT(faults_of(bomb), HasSubstr("larger than a calibration can be"));
}

TEST(RigFormat, RefusesUnsupportedLensModels) {
  const std::string text =
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
      "camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n"
      "   data: [ 800., 0.5, 320., 0., 800., 240., 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 8\n   cols: 1\n   dt: d\n"
      "   data: [ 0.1, 0., 0., 0., 0., 0.25, 0., 0. ]\n";
  const std::string faults = faults_of(text);
  EXPECT_THAT(faults, HasSubstr("camera_matrix has a skew of 0.5, expected 0"));
  EXPECT_THAT(faults, HasSubstr("distortion_coefficients has 0.25 as its number 6, expected 0"));
}

TEST(YamlCamera, CollectsFaultsInTheNameOfTheCamera) {
  const auto root = parse_yaml("a: [1, [2, 3]]\nb: word\n");
  ASSERT_TRUE(root);
  FaultCollector faults;
  YamlCamera camera("door", *root, faults);

  EXPECT_THAT(camera.numbers(*root->find({"a"}), "a", {3}), testing::Optional(testing::ElementsAre(1.0, 2.0, 3.0)));
  EXPECT_TRUE(camera.is_valid());
  EXPECT_FALSE(camera.numbers(*root->find({"b"}), "b", {1}));
  EXPECT_EQ(camera.require({"c"}, "a number"), nullptr);

  EXPECT_FALSE(camera.is_valid());
  EXPECT_THAT(text_of(faults.faults()), HasSubstr("2:4: camera 'door': b has 'word', expected finite numbers"));
  EXPECT_THAT(text_of(faults.faults()), HasSubstr("camera 'door': has no c, expected a number"));
}

TEST(QcaFile, ProjectsAPointAsComputedByHand) {
  const std::filesystem::path path = std::filesystem::path(support::shared_data_folder()) / "multiview/Calib.qca.txt";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";

  const auto parsed = parse(read(path));

  ASSERT_TRUE(parsed) << text_of(parsed.error());
  ASSERT_EQ(parsed->rig.size(), 4u);
  const CameraModel& camera = parsed->rig[0];
  EXPECT_EQ(camera.name, "cam01");
  EXPECT_EQ(camera.width_px, 1088);
  EXPECT_EQ(camera.height_px, 1920);
  // From the numbers of the file in its units: mm and 64ths of a pixel; y up, looking along -z.
  const double p[3] = {100.0, -200.0, 1000.0};
  const double d[3] = {p[0] - 1460.2323709212087, p[1] + 1909.1590482454608, p[2] - 1896.5058524092062};
  const double right = 0.5536380477336265 * d[0] + 0.8046719867383512 * d[1] + 0.2144479094331626 * d[2];
  const double up = -0.4345300743838753 * d[0] + 0.05946489349975602 * d[1] + 0.8986921279821063 * d[2];
  const double back = 0.7104002579937896 * d[0] - 0.5907342212870501 * d[1] + 0.3825762057979294 * d[2];
  const double x = right / -back;
  const double y = -up / -back;
  const double r2 = x * x + y * y;
  const double radial = 1.0 - 0.046183 * r2 + 0.139983 * r2 * r2;
  const double bent_x = x * radial + 2.0 * 0.000608 * x * y + 0.00069 * (r2 + 2.0 * x * x);
  const double bent_y = y * radial + 0.000608 * (r2 + 2.0 * y * y) + 2.0 * 0.00069 * x * y;
  const double u = (107599.671875 * bent_x + 34110.316406) / 64.0;
  const double v = (107588.828125 * bent_y + 60680.792969) / 64.0;

  const auto seen = geometry::project(camera, WorldPoint{{0.1, -0.2, 1.0}});

  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->v.x(), u, 1e-6);
  EXPECT_NEAR(seen->v.y(), v, 1e-6);
}

TEST(QcaFile, ItsCamerasLookDownAtOneVolume) {
  const std::filesystem::path path = std::filesystem::path(support::shared_data_folder()) / "multiview/Calib.qca.txt";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const auto parsed = parse_rig(RigFormat::Qca, read(path), "");
  ASSERT_TRUE(parsed);
  for (const CameraModel& camera : parsed->rig) {
    EXPECT_GT(camera.centre().v.z(), 1.0) << camera.name;  // m
    const auto middle = geometry::project(camera, WorldPoint{{0.0, 0.0, 1.0}});
    ASSERT_TRUE(middle) << camera.name;
    EXPECT_TRUE(geometry::in_image(camera, *middle)) << camera.name;
    const auto above = geometry::project(camera, WorldPoint{{0.0, 0.0, 1.5}});
    EXPECT_LT(above->v.y(), middle->v.y()) << camera.name;
  }
}

TEST(RigImport, NamesTheLineOfAnImplausibleCamera) {
  const std::string text =
      "left:\n  camera_matrix: [[900, 0, 640], [0, 900, 512], [0, 0, 1]]\n  image_size: [1280, 1024]\n"
      "  rvec: [0, 0, 0.1]\n  tvec: [0, 0, 4000]\n"
      "right:\n  camera_matrix: [[900, 0, 640], [0, 900, 512], [0, 0, 1]]\n  image_size: [1280, 1024]\n"
      "  rvec: [0, 90, 0]\n  tvec: [0, 0, 4000]\n";

  const auto parsed = parse_rig(RigFormat::OpenCv, text, "camera");

  ASSERT_FALSE(parsed);
  ASSERT_THAT(parsed.error(), testing::SizeIs(1));
  EXPECT_EQ(parsed.error()[0].line, 9U);
  EXPECT_THAT(parsed.error()[0].message, HasSubstr("looks like degrees"));
}

}  // namespace rig_format_test
}  // namespace mocap::calibration
