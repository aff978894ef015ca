#include "settings/state_folder.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "support/temporary_folder.h"

namespace mocap::settings {
namespace state_folder_test {

using testing::ElementsAre;
using testing::HasSubstr;

CameraModel camera(const std::string& name, std::vector<MaskPolygon> learnt) {
  CameraModel made;
  made.name = name;
  made.width_px = 640;
  made.height_px = 480;
  made.learnt_masks = std::move(learnt);
  return made;
}

const MaskPolygon kLamp{{{10.0, 20.0}}, {{30.0, 20.0}}, {{30.0, 40.5}}};
const MaskPolygon kDoor{{{110.0, 20.0}}, {{130.0, 20.0}}, {{130.0, 40.0}}};

TEST(StateFolder, HasNoFilesIfThereIsNone) {
  EXPECT_FALSE(state_files("").exist());
  EXPECT_TRUE(state_files("").learnt_masks.empty());
  EXPECT_EQ(state_files("/var/lib/mocapd").added_subjects, "/var/lib/mocapd/added_subjects.toml");
}

TEST(StateFolder, IsTheFirstOfTheService) {
  ::setenv("STATE_DIRECTORY", "/var/lib/mocapd:/var/lib/other", 1);
  EXPECT_EQ(state_folder_of_service(), "/var/lib/mocapd");

  ::unsetenv("STATE_DIRECTORY");
  EXPECT_EQ(state_folder_of_service(), "");
}

TEST(StateFolder, LeavesACredentialAsItIsWithoutAServiceManager) {
  const std::filesystem::path key = "$CREDENTIALS_DIRECTORY/server.key";
  ::unsetenv("CREDENTIALS_DIRECTORY");
  EXPECT_TRUE(is_unresolved_credential(resolve_credential(key)));

  ::setenv("CREDENTIALS_DIRECTORY", "/run/credentials/mocapd.service", 1);
  EXPECT_EQ(resolve_credential(key), "/run/credentials/mocapd.service/server.key");
  EXPECT_EQ(resolve_credential("server.key"), "server.key");
  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST(StateMasks, ReplaceThoseOfTheRigCameraByCamera) {
  support::TemporaryFolder folder;
  const auto file = folder.path() / "learnt_masks.toml";
  ASSERT_TRUE(
      write_masks(file, {camera("west", {kLamp}), camera("north east", {}), camera("gone", {kLamp})}, kLearntMasks));

  Rig rig{camera("west", {kDoor, kDoor}), camera("north east", {kDoor}), camera("south", {kDoor})};
  const auto notes = read_masks(file, rig, kLearntMasks);

  ASSERT_TRUE(notes) << to_text(notes.error());
  ASSERT_EQ(rig[0].learnt_masks.size(), 1U);
  EXPECT_EQ(rig[0].learnt_masks[0][2].v, Eigen::Vector2d(30.0, 40.5));
  EXPECT_TRUE(rig[1].learnt_masks.empty());
  EXPECT_EQ(rig[2].learnt_masks.size(), 1U) << "a camera without a table keeps those of the rig";
}

TEST(StateMasks, OfOneCameraAreWrittenWithoutTouchingThoseOfTheOthers) {
  support::TemporaryFolder folder;
  const auto file = folder.path() / "drawn_masks.toml";
  const auto drawn = [](const std::string& name, std::vector<MaskPolygon> masks) {
    CameraModel made = camera(name, {});
    made.masks = std::move(masks);
    return made;
  };
  ASSERT_TRUE(write_masks(file, {drawn("west", {kLamp})}, kDrawnMasks));
  ASSERT_TRUE(write_masks(file, {drawn("south", {kDoor, kLamp})}, kDrawnMasks));
  ASSERT_TRUE(write_masks(file, {drawn("south", {kDoor})}, kDrawnMasks));

  Rig rig{camera("west", {kDoor}), drawn("south", {kLamp, kLamp})};
  ASSERT_TRUE(read_masks(file, rig, kDrawnMasks));

  ASSERT_EQ(rig[0].masks.size(), 1U);
  EXPECT_EQ(rig[0].masks[0][2].v, Eigen::Vector2d(30.0, 40.5));
  EXPECT_EQ(rig[0].learnt_masks.size(), 1U);
  ASSERT_EQ(rig[1].masks.size(), 1U);
  EXPECT_EQ(rig[1].masks[0][0].v, Eigen::Vector2d(110.0, 20.0));

  folder.write("drawn_masks.toml", "[west\n");
  EXPECT_FALSE(write_masks(file, {drawn("south", {})}, kDrawnMasks)) << "a file that cannot be read is not overwritten";
}

TEST(StateMasks, OfAnotherImageSizeAreLeftOutWithAReason) {
  support::TemporaryFolder folder;
  const auto file = folder.path() / "learnt_masks.toml";
  ASSERT_TRUE(write_masks(file, {camera("west", {kLamp})}, kLearntMasks));

  Rig rig{camera("west", {kDoor, kDoor})};
  rig[0].width_px = 1280;
  const auto notes = read_masks(file, rig, kLearntMasks);

  ASSERT_TRUE(notes);
  EXPECT_EQ(rig[0].learnt_masks.size(), 2U);
  EXPECT_THAT(*notes, ElementsAre(HasSubstr("for images of 640x480, not 1280x480")));
}

TEST(StateMasks, WithFaultsAreRefusedAndWithoutAFileNothingChanges) {
  support::TemporaryFolder folder;
  Rig rig{camera("west", {kDoor})};

  ASSERT_TRUE(read_masks(folder.path() / "none.toml", rig, kLearntMasks));
  EXPECT_EQ(rig[0].learnt_masks.size(), 1U);

  const auto faults =
      read_masks(folder.write("bad.toml", "[west]\nsize = [640, 480]\nmasks = []\n"), rig, kLearntMasks);
  ASSERT_FALSE(faults);
  EXPECT_THAT(to_text(faults.error()), HasSubstr("bad.toml:3:1: camera 'west': unknown key 'masks'"));
}

}  // namespace state_folder_test
}  // namespace mocap::settings
