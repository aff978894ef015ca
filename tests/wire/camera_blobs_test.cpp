#include "wire/codec/camera_blobs.h"

#include <gmock/gmock.h>

namespace mocap::wire {
namespace camera_blobs_test {

using ::testing::HasSubstr;

TEST(CameraBlobs, RefusesAPositionFarOutsideOfAnyImage) {
  BlobFrame frame;
  frame.camera = CameraId{0};
  for (int i = 0; i < 2; ++i) frame.blobs.push_back({});
  v1::CameraBlobs message;
  encode(frame, message);
  message.mutable_x_px()->Set(1, -1e6);
  EXPECT_TRUE(decode(message));
  message.mutable_x_px()->Set(1, -1.1e6);
  EXPECT_FALSE(decode(message));
  message.mutable_x_px()->Set(1, 0.0);
  message.mutable_y_px()->Set(1, 1e12);

  const auto decoded = decode(message);

  ASSERT_FALSE(decoded);
  EXPECT_THAT(decoded.error().message,
              HasSubstr("blob 1 has a number that is not finite, a position of (0, 1000000000000) px"));
}

}  // namespace camera_blobs_test
}  // namespace mocap::wire
