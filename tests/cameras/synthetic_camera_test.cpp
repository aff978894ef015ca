#include "cameras/synthetic/synthetic_camera.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "scene/ring_rig.h"

namespace mocap::cameras {
namespace synthetic_camera_test {

MarkerSet stick() {
  MarkerSet set;
  set.skeleton.bones.resize(1);
  set.skeleton.bones[0].name = "Hips";
  set.markers = {{"a", 0, {0, 0, 0}, {}}, {"b", 0, {0, 0, 0.3}, {}}};
  return set;
}

SyntheticSettings settings() {
  SyntheticSettings all;
  all.speed = 0.0;
  all.rate_hz = 100.0;
  all.epoch = from_ns(5'000'000'000);
  return all;
}

std::vector<std::byte> copy_of(const Image& image) { return {image.bytes.begin(), image.bytes.end()}; }

TEST(SyntheticCamera, ExposesOnTheGridFromTheEpoch) {
  const auto camera = make_synthetic_camera(CameraId{3}, settings(), scene::ring_rig({})[0], stick());
  ASSERT_TRUE(camera->start());
  for (std::uint64_t i = 0; i < 5; ++i) {
    const auto frame = camera->next(Duration::zero());
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->camera, CameraId{3});
    EXPECT_EQ(frame->number, i);
    EXPECT_EQ(to_ns(frame->exposed_at), 5'000'000'000 + static_cast<std::int64_t>(i) * 10'000'000);
    EXPECT_EQ(frame->image.bytes.size(), 640U * 480U);
  }
}

TEST(SyntheticCamera, DeliversTheSameImagesAfterEachStartAndShowsTheMarkers) {
  const auto camera = make_synthetic_camera(CameraId{0}, settings(), scene::ring_rig({})[0], stick());
  ASSERT_TRUE(camera->start());
  const auto first = copy_of(camera->next(Duration::zero())->image);
  const auto second = copy_of(camera->next(Duration::zero())->image);
  camera->stop();
  ASSERT_TRUE(camera->start());

  EXPECT_EQ(copy_of(camera->next(Duration::zero())->image), first);
  EXPECT_EQ(copy_of(camera->next(Duration::zero())->image), second);
  EXPECT_NE(first, second);
  EXPECT_GT(std::to_integer<int>(std::ranges::max(first)), 150);
}

TEST(SyntheticCamera, RefusesAnUnknownMotion) {
  SyntheticSettings wrong = settings();
  wrong.motion = "tpose:2,dance";

  const auto started = make_synthetic_camera(CameraId{0}, wrong, scene::ring_rig({})[0], stick())->start();

  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::InvalidArgument);
  EXPECT_NE(started.error().message.find("dance"), std::string::npos);
}

TEST(SyntheticCamera, TimesOutWhenNoImageIsDue) {
  SyntheticSettings live = settings();
  live.speed = 1.0;
  live.epoch = host_now() + std::chrono::hours(1);
  const auto camera = make_synthetic_camera(CameraId{0}, live, scene::ring_rig({})[0], stick());
  ASSERT_TRUE(camera->start());

  EXPECT_EQ(camera->next(std::chrono::milliseconds(1)).error().code, ErrorCode::Timeout);
}

}  // namespace synthetic_camera_test
}  // namespace mocap::cameras
