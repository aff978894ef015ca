#include "cameras/v4l2/v4l2_device.h"

#include <gtest/gtest.h>

namespace mocap::cameras {
namespace v4l2_device_test {

TEST(V4l2Device, NamesTheCameraAndAFileThatIsNoVideoDevice) {
  V4l2Device device("left");

  const Status opened = device.open("/dev/null");

  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::Unsupported);
  EXPECT_NE(opened.error().message.find("camera 'left': /dev/null: "), std::string::npos) << opened.error().message;
}

TEST(V4l2Device, ReportsANodeThatDoesNotExist) {
  V4l2Device device("left");

  const Status opened = device.open("/dev/video-that-does-not-exist");

  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::NotFound);
  EXPECT_FALSE(device.is_open());
}

}  // namespace v4l2_device_test
}  // namespace mocap::cameras
