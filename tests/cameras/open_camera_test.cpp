#include "cameras/open_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cameras/aravis/aravis_settings.h"
#include "cameras/replay/replay_settings.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "cameras/v4l2/v4l2_settings.h"

namespace mocap::cameras {
namespace open_camera_test {

using testing::HasSubstr;

Rig rig_of(const std::string& name) {
  CameraModel model;
  model.name = name;
  return {model};
}

std::string refusal_of(const CameraSettings& settings, const CameraSurroundings& around = {}) {
  const auto opened = open_camera(CameraId{0}, settings, around);
  if (opened) return "none";
  EXPECT_EQ(opened.error().code, ErrorCode::InvalidArgument);
  return opened.error().message;
}

TEST(OpenCamera, MakesACameraOfEachDriverWithoutSearchingTheDevice) {
  AravisSettings aravis;
  aravis.serial = "none such";
  V4l2Settings v4l2;
  v4l2.device = "/dev/none-such";
  ReplaySettings replay;
  replay.folder = "/none/such";
  const MarkerSet marker_set;
  const Rig rig = rig_of("north");
  const CameraSurroundings around{.rig = &rig, .marker_set = &marker_set};

  EXPECT_TRUE(open_camera(CameraId{0}, {"north", aravis}));
  EXPECT_TRUE(open_camera(CameraId{0}, {"north", v4l2}));
  EXPECT_TRUE(open_camera(CameraId{0}, {"north", replay}));
  EXPECT_TRUE(open_camera(CameraId{0}, {"north", SyntheticSettings{}}, around));
}

TEST(OpenCamera, NeedsExactlyOneKeyThatIdentifiesAnAravisCamera) {
  AravisSettings two;
  two.serial = "DA1";
  two.address = "10.0.0.2";

  EXPECT_THAT(refusal_of({"north", AravisSettings{}}),
              HasSubstr("camera 'north': 0 of serial, device_name, address and mac"));
  EXPECT_THAT(refusal_of({"north", two}), HasSubstr("2 of serial, device_name, address and mac are set"));
}

TEST(OpenCamera, RefusesAnUnknownClock) {
  AravisSettings settings;
  settings.serial = "DA1";
  settings.clock = "ntp";

  EXPECT_THAT(refusal_of({"north", settings}), HasSubstr("clock is 'ntp', expected one of estimated, utc"));
}

TEST(OpenCamera, NeedsASyntheticCameraInTheRig) {
  const MarkerSet marker_set;
  const Rig rig = rig_of("south");

  EXPECT_THAT(refusal_of({"north", SyntheticSettings{}}), HasSubstr("needs the marker set"));
  EXPECT_THAT(refusal_of({"north", SyntheticSettings{}}, {.rig = &rig, .marker_set = &marker_set}),
              HasSubstr("the rig has no camera of this name"));
}

}  // namespace open_camera_test
}  // namespace mocap::cameras
