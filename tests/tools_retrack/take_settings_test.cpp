#include "lib/retrack/take_settings.h"

#include <gmock/gmock.h>

#include "settings/subject/subject_file.h"
#include "tools_retrack/recorded_world.h"

namespace mocap::retrack {
namespace take_settings_test {

using ::testing::HasSubstr;

class SettingsOfATake : public testing::Test {
 protected:
  SettingsOfATake() : path_(world_.record("walk", {.sets = 2})) {}

  Result<TakeSettings> load(const OtherFiles& others = {}) const {
    const auto take = take::TakeReader::open(path_);
    EXPECT_TRUE(take) << take.error().message;
    return load_take_settings(*take, others);
  }

  // Writes the body of a subject, with another marker offset than its marker set.
  void write_body(const std::string& folder, const std::string& name) const {
    settings::SubjectFile body;
    body.name = name;
    body.marker_set_file = world_.settings().subjects[0].marker_set_file;
    body.marker_set = world_.settings().subject_models[0].marker_set;
    body.marker_set.markers[3].offset_m.y() = 0.321;
    body.bone_residuals_m.assign(body.marker_set.skeleton.bones.size(), 0.0);
    body.marker_residuals_m.assign(body.marker_set.markers.size(), 0.0);
    std::filesystem::create_directories(world_.folder() / folder);
    ASSERT_TRUE(settings::save_subject(world_.folder() / folder / (name + ".toml"), body));
  }

  RecordedWorld world_;
  std::filesystem::path path_;
};

TEST_F(SettingsOfATake, AreThoseOfItsRun) {
  const auto loaded = load();

  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->settings->rig.size(), RecordedWorld::kCameras);
  EXPECT_EQ(loaded->settings->rig[2].camera_from_world.translation,
            world_.settings().rig[2].camera_from_world.translation);
  EXPECT_EQ(loaded->settings->subject_models.size(), 1U);
  EXPECT_EQ(loaded->files.size(), take::TakeReader::open(path_)->files().size());
}

TEST_F(SettingsOfATake, MayComeFromAnotherConfiguration) {
  const auto other = world_.folder() / "other.toml";
  std::filesystem::copy_file(world_.folder() / "mocapd.toml", other);
  std::ofstream(other, std::ios::app) << "[label]\nmost_rms_mm = 17\n";

  const auto loaded = load({.settings = other});

  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->settings->label.most_rms_m, 0.017);
  EXPECT_EQ(loaded->files.front().name, "configuration/other.toml");
}

TEST_F(SettingsOfATake, TakeBodiesFromAFolder) {
  write_body("bodies", "actor");

  const auto loaded = load({.subjects = world_.folder() / "bodies"});

  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(loaded->settings->subject_models[0].fitted);
  EXPECT_EQ(loaded->settings->subject_models[0].marker_set.markers[3].offset_m.y(), 0.321);
  EXPECT_EQ(loaded->files.back().name, "subjects/actor.toml");
}

TEST_F(SettingsOfATake, RefuseAFolderWithoutABodyOfASubject) {
  write_body("bodies", "nobody");

  const auto refused = load({.subjects = world_.folder() / "bodies"});

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::NotFound);
  EXPECT_THAT(refused.error().message, HasSubstr("expected a file NAME.toml"));
}

TEST_F(SettingsOfATake, RefuseARigOfAnotherImageSize) {
  Rig rig = world_.settings().rig;
  rig[1].width_px = 640;
  ASSERT_TRUE(settings::save_rig(world_.folder() / "small.toml", rig, {}));

  const auto refused = load({.rig = world_.folder() / "small.toml"});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("camera 'cam2': size is 640x1024, expected 1280x1024"));
}

TEST_F(SettingsOfATake, NameTheFileThatIsNotThere) {
  const auto refused = load({.settings = world_.folder() / "absent.toml"});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("absent.toml"));
}

TEST(BodiesOfADescription, ReplaceThoseOfTheSameMarkers) {
  const RecordedWorld world;
  settings::DaemonSettings settings = world.settings();
  Description description = describe(settings, "session");
  use_bodies(description, settings);
  EXPECT_FALSE(settings.subject_models[0].fitted) << "nothing differs";
  description.subjects[0].marker_set.markers[2].offset_m.x() = 0.5;

  use_bodies(description, settings);

  EXPECT_TRUE(settings.subject_models[0].fitted);
  EXPECT_EQ(settings.subject_models[0].marker_set.markers[2].offset_m.x(), 0.5);
  description.subjects[0].marker_set.markers.pop_back();
  description.subjects[0].marker_set.markers[2].offset_m.x() = 0.7;
  use_bodies(description, settings);
  EXPECT_EQ(settings.subject_models[0].marker_set.markers[2].offset_m.x(), 0.5) << "another marker set";
}

}  // namespace take_settings_test
}  // namespace mocap::retrack
