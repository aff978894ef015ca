#include "settings/rig/rig_lenses.h"

#include <gmock/gmock.h>

#include <fstream>

#include "settings/rig/rig_file.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace rig_lenses_test {

using testing::HasSubstr;

constexpr const char* kRig = R"(# two cameras
["north east"]   # by the window
name = "north east"
size = [640, 480]
matrix = [
  [500.0, 0.0, 320.0],
  [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]  # by eye
rotation = [0.1, 0.2, 0.3]
translation = [1.0, 2.0, 3.0]

[door]
size = [640, 480]
matrix = [[400.0, 0.0, 320.0], [0.0, 400.0, 240.0], [0.0, 0.0, 1.0]]
distortions = [0.1, 0.0, 0.0, 0.0]
rotation = [0.0, 0.0, 0.0]
translation = [0.0, 0.0, 0.0]
fisheye = true

[metadata]
date = "spring")";

CameraModel camera(const std::string& name, LensKind kind) {
  CameraModel camera;
  camera.name = name;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.lens = {kind, 510.25, 511.5, 321.0, 239.0, {}};
  camera.lens.distortion << -0.2, 0.05, 1e-3, -2e-3, kind == LensKind::Fisheye ? 0.0 : 0.01;
  return camera;
}

std::string read(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(RigLenses, ACalibratedLensIsNotFromAFieldOfView) {
  const support::TemporaryFolder folder;
  CameraModel guessed = camera("door", LensKind::Pinhole);
  guessed.lens.is_from_fov = true;
  const auto path = folder.path() / "rig.toml";
  ASSERT_TRUE(save_rig(path, {guessed}, {}));
  const auto before = load_rig(path);

  const Status saved = save_lenses(path, {camera("door", LensKind::Pinhole)});

  ASSERT_TRUE(saved) << saved.error().message;
  const auto after = load_rig(path);
  ASSERT_TRUE(before && after);
  EXPECT_TRUE((*before)[0].lens.is_from_fov);
  EXPECT_FALSE((*after)[0].lens.is_from_fov);
}

TEST(RigLenses, ChangesTheLensAndNothingElse) {
  const support::TemporaryFolder folder;
  const auto path = folder.write("rig.toml", kRig);

  const Status saved = save_lenses(path, {camera("north east", LensKind::Pinhole)});

  ASSERT_TRUE(saved) << saved.error().message;
  const auto rig = load_rig(path);
  ASSERT_TRUE(rig) << to_text(rig.error());
  EXPECT_EQ((*rig)[0].lens.fx_px, 510.25);
  EXPECT_EQ((*rig)[0].lens.distortion[4], 0.01);
  EXPECT_EQ((*rig)[0].camera_from_world.translation.z(), 3.0);
  EXPECT_EQ((*rig)[1].lens.fx_px, 400.0);
  const std::string text = read(path);
  EXPECT_THAT(text, HasSubstr("# two cameras\n[\"north east\"]   # by the window\n"));
  EXPECT_THAT(text, HasSubstr("  # by eye\n"));
  EXPECT_THAT(text, HasSubstr(std::string(kRig).substr(std::string(kRig).find("[door]"))));
}

TEST(RigLenses, AddsACameraThatTheFileDoesNotHave) {
  const support::TemporaryFolder folder;
  const auto path = folder.write("rig.toml", kRig);

  ASSERT_TRUE(save_lenses(path, {camera("south", LensKind::Fisheye)}));

  const auto rig = load_rig(path);
  ASSERT_TRUE(rig) << to_text(rig.error());
  ASSERT_EQ(rig->size(), 3u);
  EXPECT_EQ((*rig)[2].name, "south");
  EXPECT_EQ((*rig)[2].lens.kind, LensKind::Fisheye);
  EXPECT_THAT(read(path), testing::StartsWith(kRig));
}

TEST(RigLenses, CreatesAFileIfThereIsNone) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "new.toml";

  ASSERT_TRUE(save_lenses(path, {camera("a", LensKind::Pinhole), camera("b", LensKind::Fisheye)}));

  const auto rig = load_rig(path);
  ASSERT_TRUE(rig) << to_text(rig.error());
  EXPECT_EQ(rig->size(), 2u);
}

TEST(RigLenses, RefusesAFileThatItCannotEditAndKeepsIt) {
  const support::TemporaryFolder folder;
  const auto path = folder.write("rig.toml", kRig);
  CameraModel large = camera("door", LensKind::Pinhole);
  large.width_px = 1280;

  const Status saved = save_lenses(path, {large});

  ASSERT_FALSE(saved);
  EXPECT_THAT(saved.error().message, HasSubstr("camera 'door' is 640x480 there, its images are 1280x480"));
  EXPECT_EQ(read(path), kRig);
}

}  // namespace rig_lenses_test
}  // namespace mocap::settings
