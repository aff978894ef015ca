#include "cameras/camera_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "base/key_check.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/camera_make.h"
#include "cameras/replay/replay_settings.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "cameras/v4l2/v4l2_formats.h"
#include "cameras/v4l2/v4l2_settings.h"

namespace mocap::cameras {
namespace camera_settings_test {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> messages_of(const std::vector<KeyFault>& faults) {
  std::vector<std::string> messages;
  for (const KeyFault& fault : faults) messages.push_back(fault.message);
  return messages;
}

TEST(CameraMakes, HaveDefaultsWithinTheirOwnRanges) {
  for (const CameraMake& make : camera_makes()) {
    SCOPED_TRACE(make.name.driver);
    CameraSettings camera{"west", make.defaults()};

    EXPECT_EQ(camera.driver.driver(), make.name.driver);
    EXPECT_THAT(messages_of(check_keys(camera)), ElementsAre());
  }
}

TEST(CameraMakes, AreFoundByTheirDriver) {
  for (const CameraMake& make : camera_makes()) EXPECT_EQ(find_make(make.name.driver), &make);
  EXPECT_EQ(find_make("v4l"), nullptr);
  EXPECT_EQ(find_make(""), nullptr);
}

TEST(CameraSettings, RefuseANameThatCannotBeTheNameOfAFolder) {
  for (const char* name : {"", "a/b", "a'b", "a\"b", "a\nb"}) {
    EXPECT_THAT(messages_of(faults_of(CameraSettings{name, SyntheticSettings{}})),
                ElementsAre(HasSubstr("expected 1 to 63 characters without quotes and slashes")))
        << name;
  }
  EXPECT_TRUE(faults_of(CameraSettings{std::string(63, 'n'), SyntheticSettings{}}).empty());
}

TEST(CameraSettings, RefuseTheNameOfATableThatARigFileHasAnyway) {
  EXPECT_THAT(messages_of(faults_of(CameraSettings{"metadata", SyntheticSettings{}})),
              ElementsAre("name is 'metadata', which a rig file has for its facts; expected another name"));
}

TEST(CameraSettings, RefuseAThresholdBetweenZeroAndOne) {
  CameraSettings camera{"west", SyntheticSettings{}};
  camera.threshold = 0.5;

  EXPECT_THAT(messages_of(faults_of(camera)), ElementsAre("threshold is 0.5, expected 1 to 255, or 0: from the noise"));
}

TEST(AravisSettings, NeedExactlyOneWayToFindTheCamera) {
  const AravisSettings none;
  AravisSettings two;
  two.serial = "DA1";
  two.mac = "00:11:1c:f5:a0:01";

  EXPECT_THAT(messages_of(faults_of(none)), ElementsAre(HasSubstr("0 of serial, device_name, address and mac")));
  EXPECT_THAT(messages_of(faults_of(two)), ElementsAre(HasSubstr("2 of serial, device_name, address and mac")));
}

TEST(AravisSettings, NeedARateForActionCommands) {
  AravisSettings camera;
  camera.serial = "DA1";
  camera.trigger = "action";

  EXPECT_THAT(messages_of(faults_of(camera)), ElementsAre("trigger = \"action\" needs rate_hz"));
  camera.rate_hz = 100.0;
  EXPECT_TRUE(faults_of(camera).empty());
  EXPECT_TRUE(check_keys(camera).empty());
}

TEST(AravisSettings, KnowTheirSizeIfBothSidesAreSet) {
  AravisSettings camera;
  camera.width_px = 640;
  EXPECT_FALSE(facts_of(camera, "west").size.has_value());

  camera.height_px = 480;
  ASSERT_TRUE(facts_of(camera, "west").size.has_value());
  EXPECT_EQ(facts_of(camera, "west").size->height_px, 480);
}

TEST(V4l2Settings, NeedExactlyOneWayToFindTheCamera) {
  const V4l2Settings none;
  V4l2Settings two;
  two.serial = "A";
  two.bus = "B";

  EXPECT_THAT(messages_of(faults_of(none)), ElementsAre(HasSubstr("device is missing")));
  EXPECT_THAT(messages_of(faults_of(two)), ElementsAre(HasSubstr("2 of device, serial and bus")));
}

TEST(V4l2Settings, TakeEveryFormatThatTheCameraReads) {
  for (const KnownFormat& format : known_video_formats()) {
    V4l2Settings camera;
    camera.pixel_format = format.name;
    EXPECT_TRUE(check_keys(camera).empty()) << format.name;
  }
}

TEST(ReplaySettings, ShareAFolderIfItHoldsAFolderForEachCamera) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "replay_settings_test";
  std::filesystem::create_directories(folder / "west");
  ReplaySettings camera;
  camera.folder = folder;

  EXPECT_TRUE(facts_of(camera, "west").device.empty());
  EXPECT_EQ(facts_of(camera, "east").device.size(), 1U);
  EXPECT_TRUE(facts_of(camera, "west").recorded_time);
  std::filesystem::remove_all(folder);
}

TEST(SyntheticSettings, RefuseAnUnknownMotion) {
  SyntheticSettings camera;
  camera.motion = "dance:2";

  EXPECT_THAT(messages_of(faults_of(camera)), ElementsAre(HasSubstr("motion: 'dance:2'")));
}

TEST(SyntheticSettings, UseRecordedTimeIfTheyDoNotFollowTheClock) {
  SyntheticSettings camera;
  EXPECT_FALSE(facts_of(camera, "west").recorded_time);

  camera.speed = 0.0;
  EXPECT_TRUE(facts_of(camera, "west").recorded_time);
}

}  // namespace camera_settings_test
}  // namespace mocap::cameras
