#include "calibrate/lens_command.h"
#include "lib/cli/app.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "settings/rig/rig_file.h"
#include "support/board_images.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace lens_command_test {

using ::testing::HasSubstr;

constexpr int kWidth_px = 320;
constexpr int kHeight_px = 240;
const calibration::Board kBoard{calibration::BoardKind::Charuco, 6, 5, 0.04, 0.03, "4x4_50"};

Lens truth() {
  Lens lens{LensKind::Pinhole, 262.0, 261.0, 163.0, 117.0, {}};
  lens.distortion << -0.15, 0.03, 0.0, 0.0, 0.0;
  return lens;
}

void draw_boards(const std::filesystem::path& folder, int boards, double tilt_rad) {
  std::filesystem::create_directories(folder);
  support::BoardImages images(truth(), kWidth_px, kHeight_px, kBoard);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < boards; ++i) {
    const Eigen::Vector2d px(160.0 + 110.0 * unit(random), 120.0 + 80.0 * unit(random));
    const auto pose = images.pose(px, 0.30 + 0.05 * unit(random), tilt_rad * std::abs(unit(random)), random);
    const auto pixels = images.draw(pose, random);
    cv::Mat image(kHeight_px, kWidth_px, CV_8UC1);
    std::copy(pixels.begin(), pixels.end(), image.data);
    cv::imwrite((folder / ("00000" + std::to_string(i) + ".png")).string(), image);
  }
}

int run(const std::vector<std::string>& arguments) {
  cli::App app("test");
  LensCommand lens;
  lens.add(app);
  std::vector<const char*> words{"mocap-calibrate", "lens"};
  for (const std::string& argument : arguments) words.push_back(argument.c_str());
  EXPECT_EQ(app.parse(static_cast<int>(words.size()), words.data()), std::nullopt);
  return lens.run().value_or(-1);
}

std::vector<std::string> with_board(std::vector<std::string> words) {
  for (const char* word : {"--columns", "6", "--rows", "5", "--square-mm", "40"}) words.emplace_back(word);
  return words;
}

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

constexpr const char* kRig = R"(# the north hall
[door]           # moved in spring
name = "door"
size = [320, 240]
matrix = [[300.0, 0.0, 160.0], [0.0, 300.0, 120.0], [0.0, 0.0, 1.0]]
rotation = [0.1, 0.2, 0.3]
translation = [1.0, 2.0, 3.0]
fisheye = false
mask = [[[1.0, 2.0], [3.0, 4.0], [5.0, 0.0]]]

[metadata]
who = "me"
)";

TEST(LensCommand, WritesTheLensesOfImagesIntoTheRigAndKeepsTheRest) {
  const support::TemporaryFolder folder;
  draw_boards(folder.path() / "shots/door", 24, 0.8);
  draw_boards(folder.path() / "shots/window", 24, 0.8);
  const auto rig_file = folder.write("rig.toml", kRig);

  const int exit = run(with_board({"--images", (folder.path() / "shots").string(), "--rig", rig_file.string()}));

  ASSERT_EQ(exit, 0);
  const auto rig = settings::load_rig(rig_file);
  ASSERT_TRUE(rig) << settings::to_text(rig.error());
  ASSERT_EQ(rig->size(), 2u);
  for (const CameraModel& camera : *rig) {
    EXPECT_NEAR(camera.lens.fx_px, truth().fx_px, 1.5) << camera.name;  // small images: corners to 0.05 px
    EXPECT_NEAR(camera.lens.cx_px, truth().cx_px, 1.5) << camera.name;
    EXPECT_NEAR(camera.lens.distortion[0], -0.15, 0.03) << camera.name;
  }
  EXPECT_EQ((*rig)[0].camera_from_world.translation, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ((*rig)[0].masks.size(), 1u);
  EXPECT_EQ((*rig)[1].name, "window");
  const std::string text = read(rig_file);
  EXPECT_THAT(text, HasSubstr("# the north hall\n[door]           # moved in spring\n"));
  EXPECT_THAT(text, HasSubstr("who = \"me\""));
}

TEST(LensCommand, RunsTheCamerasOfAConfigurationAndCreatesTheRigFile) {
  const support::TemporaryFolder folder;
  draw_boards(folder.path() / "door", 24, 0.8);
  draw_boards(folder.path() / "window", 24, 0.8);
  std::string text = "[capture]\nrig = \"new.toml\"\n";
  for (const char* name : {"door", "window"})
    text += fmt::format("[[camera]]\nname = \"{}\"\ndriver = \"replay\"\nfolder = \"{}\"\n", name,
                        (folder.path() / name).string());
  const auto config = folder.write("mocapd.toml", text);

  const int exit = run(with_board({"--config", config.string()}));

  ASSERT_EQ(exit, 0);
  const auto rig = settings::load_rig(folder.path() / "new.toml");
  ASSERT_TRUE(rig) << settings::to_text(rig.error());
  ASSERT_EQ(rig->size(), 2u);
  for (const CameraModel& camera : *rig) {
    EXPECT_NEAR(camera.lens.fx_px, truth().fx_px, 1.5) << camera.name;  // small images: corners to 0.05 px
    EXPECT_NEAR(camera.lens.distortion[0], -0.15, 0.03) << camera.name;
  }
}

TEST(LensCommand, WritesNothingIfTheBoardsDoNotDetermineTheLens) {
  const support::TemporaryFolder folder;
  draw_boards(folder.path() / "shots/door", 12, 0.0);
  const auto rig_file = folder.write("rig.toml", kRig);

  const int exit = run(with_board({"--images", (folder.path() / "shots").string(), "--rig", rig_file.string()}));

  EXPECT_EQ(exit, 65);
  EXPECT_EQ(read(rig_file), kRig);
}

TEST(LensCommand, WritesNothingIfTheRigHasAnotherImageSize) {
  const support::TemporaryFolder folder;
  draw_boards(folder.path() / "shots/door", 24, 0.8);
  std::string other = kRig;
  other.replace(other.find("[320, 240]"), 10, "[640, 480]");
  const auto rig_file = folder.write("rig.toml", other);

  const int exit = run(with_board({"--images", (folder.path() / "shots").string(), "--rig", rig_file.string()}));

  EXPECT_EQ(exit, 65);
  EXPECT_EQ(read(rig_file), other);
}

TEST(LensCommand, RefusesAMissingRigFileAndBadInputBeforeItRunsCameras) {
  const support::TemporaryFolder folder;
  const auto config = folder.write("mocapd.toml",
                                   "[capture]\nneeds_rig = false\n[[camera]]\nname = \"door\"\ndriver = \"replay\"\n"
                                   "folder = \".\"\n");
  const auto bad = folder.write("bad.toml", "[capture]\nrgi = 1\n");
  const std::string rig = (folder.path() / "rig.toml").string();
  std::filesystem::create_directory(folder.path() / "shots");
  folder.write("shots/image.png", "no image");

  EXPECT_EQ(run(with_board({"--config", config.string()})), kExitUsage);
  EXPECT_EQ(run(with_board({"--config", config.string(), "--camera", "window", "--rig", rig})), kExitUsage);
  EXPECT_EQ(run(with_board({"--config", config.string(), "--rig", (folder.path() / "none/rig.toml").string()})),
            kExitCannotWrite);
  EXPECT_EQ(run(with_board({"--config", bad.string(), "--rig", rig})), kExitConfig);
  EXPECT_EQ(run(with_board({"--images", (folder.path() / "none").string(), "--rig", rig})), kExitNoInput);
  EXPECT_EQ(run(with_board({"--images", (folder.path() / "shots").string(), "--rig", rig})), kExitData);
}

TEST(LensCommand, EndsWithTheCodeOfAFileThatCannotBeWritten) {
  const support::TemporaryFolder folder;
  draw_boards(folder.path() / "shots/door", 24, 0.8);
  const auto rig_file = folder.path() / "missing" / "rig.toml";

  const int exit = run(with_board({"--images", (folder.path() / "shots").string(), "--rig", rig_file.string()}));

  EXPECT_EQ(exit, 73);
}

TEST(LensCommand, RefusesAnEmptyFolderAndAnIncompleteCommandLine) {
  const support::TemporaryFolder folder;
  EXPECT_EQ(run({"--images", folder.path().string(), "--dry-run"}), 66);
  EXPECT_EQ(run({"--images", folder.path().string()}), 64);
  EXPECT_EQ(run({"--dry-run"}), 64);
  EXPECT_EQ(run({"--images", folder.path().string(), "--dry-run", "--marker-mm", "50"}), 64);
}

}  // namespace lens_command_test
}  // namespace mocap::calibrate
