#include "lib/simworld/scene_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::simworld {
namespace scene_file_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class SceneFileTest : public ::testing::Test {
 protected:
  Result<SceneFile, settings::Faults> load(const std::string& text) {
    std::ofstream(folder_.path() / "scene.toml") << text;
    return load_scene(folder_.path() / "scene.toml");
  }

  std::string faults(const std::string& text) {
    const auto scene = load(text);
    return scene ? "none" : settings::to_text(scene.error());
  }

  support::TemporaryFolder folder_;
};

constexpr const char* kActor = "[[actor]]\nname = 'a'\nmotion = 'walk'\nmarker_set = 'm.toml'\n";

TEST_F(SceneFileTest, ReadsImageLosses) {
  const std::string loss = "[[image_loss]]\nfor_min_s = 0.1\nfor_max_s = 0.3\nreturn_s = 0.2\ntimes = 3\n";

  const auto scene = load(kActor + loss);

  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->image_losses.size(), 1U);
  EXPECT_EQ(scene->image_losses[0].for_max_s, 0.3);
  EXPECT_EQ(scene->image_losses[0].times, 3);
  EXPECT_THAT(faults(kActor + loss + "[[image_loss]]\nfor_min_s = 2\n"), HasSubstr("for_max_s is less than for_min_s"));
}

TEST_F(SceneFileTest, ReadsATypicalScene) {
  const auto scene = load(kActor);

  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->ring.cameras, 8);
  EXPECT_EQ(scene->ring.radius_m, 4.0);
  EXPECT_EQ(scene->ring.height_m, 2.5);
  EXPECT_EQ(scene->ring.width_px, 1280);
  EXPECT_EQ(scene->rate_hz, 120.0);
  EXPECT_EQ(scene->false_blobs, 0.02);
  EXPECT_TRUE(scene->occlusion);
  EXPECT_EQ(scene->actors.at(0).marker_set, folder_.path() / "m.toml");
}

TEST_F(SceneFileTest, ReportsEveryFaultWithItsLine) {
  const std::string told =
      faults(std::string(kActor) + "sise = 0.9\n\n[image]\nfalse_blobs = 11\n\n[hide]\nshare = 1\n");

  EXPECT_THAT(told, HasSubstr("scene.toml:5:1: actor 'a': unknown key 'sise', did you mean 'size'?"));
  EXPECT_THAT(told, HasSubstr("scene.toml:8:15: image: false_blobs is 11"));
  EXPECT_THAT(told, HasSubstr("scene.toml:10:"));  // [hide] is not an array of tables
}

TEST_F(SceneFileTest, RequiresAMotionForEveryActor) {
  EXPECT_THAT(faults("[[actor]]\nname = 'a'\nmarker_set = 'm.toml'\n"), HasSubstr("actor 'a' has no motion"));
  EXPECT_EQ(faults("[[actor]]\nname = 'a'\nmarker_set = 'm.toml'\n[[clip]]\nmotion = 'x.bvh'\n"), "none");
}

TEST_F(SceneFileTest, RequiresDifferentActorNames) {
  EXPECT_THAT(faults("seconds = 1\n"), HasSubstr("there is no [[actor]]"));
  EXPECT_THAT(faults(std::string(kActor) + kActor), HasSubstr("actor 'a' is there twice"));
  EXPECT_THAT(faults(std::string(kActor) + "[[only_camera]]\nactor = 'b'\nmarkers = 'x'\n"),
              HasSubstr("there is no actor 'b'"));
}

TEST_F(SceneFileTest, AcceptsTheSectionsOfThePipelineSteps) {
  const auto scene = load(std::string(kActor) + "[match]\ncalibration_px = 0.25\n");

  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->daemon.match.calibration_px, 0.25);
  EXPECT_THAT(faults(std::string(kActor) + "[match]\ncalibration = 0.25\n"), HasSubstr("unknown key 'calibration'"));
  EXPECT_THAT(faults(std::string(kActor) + "[publish]\n"), HasSubstr("unknown key 'publish'"));
}

TEST_F(SceneFileTest, FindsAMotionNextToTheSceneFile) {
  std::ofstream(folder_.path() / "clip.bvh") << "HIERARCHY";
  const auto scene = load(kActor);
  ASSERT_TRUE(scene);

  EXPECT_EQ(find_motion(*scene, "clip.bvh").value(), folder_.path() / "clip.bvh");
  EXPECT_EQ(find_motion(*scene, "none.bvh").error().code, ErrorCode::NotFound);
}

TEST(SceneFiles, OfTheProjectAreAllValid) {
  std::size_t count = 0;
  for (const auto& entry : fs::directory_iterator(support::source_folder() + "/config/scenes")) {
    const auto scene = load_scene(entry.path());
    EXPECT_TRUE(scene) << (scene ? "" : settings::to_text(scene.error()));
    ++count;
  }
  EXPECT_GE(count, 9U);
}

}  // namespace scene_file_test
}  // namespace mocap::simworld
