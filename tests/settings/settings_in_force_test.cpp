#include "settings/settings_in_force.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "settings/rig/rig_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::settings {
namespace settings_in_force_test {

class SettingsInForce : public testing::Test {
 protected:
  SettingsInForce() {
    CameraModel camera;
    camera.width_px = 640;
    camera.height_px = 480;
    camera.lens.fx_px = camera.lens.fy_px = 500.0;
    rig_.assign(1, camera);
    rig_[0].name = "west";
    EXPECT_TRUE(save_rig(folder_.path() / "rig.toml", rig_, {}));
    set_ = std::string(support::source_folder()) + "/config/markersets/openmocap18.toml";
    config_ =
        folder_.write("daemon.toml",
                      "[capture]\nrig = \"rig.toml\"\n[record]\nblobs = \"all.blobs\"\n[[camera]]\nname = \"west\"\n"
                      "driver = \"replay\"\nfolder = \"/tmp\"\n[[subject]]\nname = \"anna\"\nmarker_set = \"" +
                          set_ + "\"\nkeep = \"/kept/anna.toml\"\n");
    std::filesystem::create_directory(folder_.path() / "state");
  }

  std::string added(const std::string& name) const {
    return "[[subject]]\nname = \"" + name + "\"\nmarker_set = \"" + set_ + "\"\nkeep = \"" + name + ".toml\"\n";
  }

  static SettingInForce find(const InForce& all, const std::string& key) {
    const auto found = std::ranges::find(all.settings, key, &SettingInForce::key);
    return found == all.settings.end() ? SettingInForce{} : *found;
  }

  support::TemporaryFolder folder_;
  Rig rig_;
  std::string set_;
  std::filesystem::path config_;
  StateFiles state_ = state_files(folder_.path() / "state");
};

TEST_F(SettingsInForce, HaveTheFileAndTheLineThatTheyComeFrom) {
  folder_.write("state/added_subjects.toml", added("ben"));
  rig_[0].learnt_masks = {{{{1.0, 2.0}}, {{3.0, 2.0}}, {{3.0, 4.0}}}};
  ASSERT_TRUE(write_masks(state_.learnt_masks, rig_, kLearntMasks));

  const auto all = settings_in_force(config_, state_);

  ASSERT_TRUE(all) << to_text(all.error());
  EXPECT_EQ(find(*all, "capture.rig").from, config_.string() + ":2");
  EXPECT_EQ(find(*all, "capture.rate_hz").from, "default");
  EXPECT_EQ(find(*all, "camera.west.driver").from, config_.string() + ":7");
  EXPECT_EQ(find(*all, "subject.anna.name").from, config_.string() + ":10");
  EXPECT_EQ(find(*all, "subject.ben.name").from, state_.added_subjects.string() + ":2");
  EXPECT_EQ(find(*all, "rig.west.mask_learnt").value, "1 polygons");
  EXPECT_EQ(find(*all, "rig.west.mask_learnt").from, state_.learnt_masks.string() + ":6");
}

TEST_F(SettingsInForce, HaveTheLineOfAFormerName) {
  const auto config = folder_.write("former.toml",
                                    "[track]\nbirth_speed_px_s = 700\n[capture]\nrig = \"rig.toml\"\n"
                                    "[[camera]]\nname = \"west\"\ndriver = \"replay\"\nfolder = \"/tmp\"\n");

  const auto all = settings_in_force(config, {});

  ASSERT_TRUE(all) << to_text(all.error());
  const SettingInForce speed = find(*all, "track.initial_speed_px_s");
  EXPECT_EQ(speed.value, "700");
  EXPECT_EQ(speed.from, config.string() + ":2");
}

TEST_F(SettingsInForce, HaveRelativeNamesOfWrittenFilesInTheStateFolder) {
  folder_.write("state/added_subjects.toml", added("ben"));

  const auto with = settings_in_force(config_, state_);
  const auto without = settings_in_force(config_, {});

  ASSERT_TRUE(with) << to_text(with.error());
  ASSERT_TRUE(without) << to_text(without.error());
  EXPECT_EQ(find(*with, "record.blobs").value, "\"" + (state_.folder / "all.blobs").string() + "\"");
  EXPECT_EQ(find(*with, "subject.ben.keep").value, "\"" + (state_.folder / "ben.toml").string() + "\"");
  EXPECT_EQ(find(*with, "subject.anna.keep").value, "\"/kept/anna.toml\"") << "an absolute name stays";
  EXPECT_EQ(find(*without, "record.blobs").value, "\"" + (folder_.path() / "all.blobs").string() + "\"");
  EXPECT_EQ(find(*without, "subject.ben.name").value, "") << "the state files are not read";
}

TEST_F(SettingsInForce, PreferASubjectOfTheConfigurationToAnAddedOneOfTheSameName) {
  folder_.write("state/added_subjects.toml", added("anna") + added("ben"));

  const auto all = settings_in_force(config_, state_);

  ASSERT_TRUE(all) << to_text(all.error());
  EXPECT_EQ(find(*all, "subject.anna.keep").from, config_.string() + ":12");
  EXPECT_EQ(find(*all, "subject.ben.name").from, state_.added_subjects.string() + ":6");
  EXPECT_THAT(all->notes, testing::Contains(testing::HasSubstr("subject anna: the configuration's is used")));
}

TEST_F(SettingsInForce, AreRefusedWithTheFaultsOfTheStateFiles) {
  folder_.write("state/added_subjects.toml", "[[subject]]\nnam = \"ben\"\n[detect]\n");

  const auto all = settings_in_force(config_, state_);

  ASSERT_FALSE(all);
  EXPECT_THAT(to_text(all.error()), testing::HasSubstr("added_subjects.toml:2:1: added subject 1: unknown key 'nam'"));
  EXPECT_THAT(to_text(all.error()), testing::HasSubstr("added_subjects.toml:3:2: unknown key 'detect'"));
}

}  // namespace settings_in_force_test
}  // namespace mocap::settings
