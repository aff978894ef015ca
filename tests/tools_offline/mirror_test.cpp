#include "lib/offline/mirror.h"

#include <gtest/gtest.h>

namespace mocap::offline {
namespace mirror_test {

OwnedSet set_at(std::uint64_t number, std::int64_t at_ns) {
  OwnedSet set;
  set.number = number;
  set.expected_views = 2;
  for (std::uint32_t camera = 0; camera < 2; ++camera) {
    BlobFrame& image = set.images.emplace_back();
    image.camera = CameraId{camera};
    image.number = 100 + number;
    image.exposed_at = from_ns(at_ns + 20 * camera);
    image.received_at = image.exposed_at + Duration(5000);
    image.detected_at = image.exposed_at + Duration(6000);
  }
  return set;
}

TEST(Mirror, LetsTheLastSetComeFirst) {
  const Mirror mirror(from_ns(1'000), from_ns(9'000));

  const OwnedSet early = mirror.mirrored(set_at(1, 1'000)), late = mirror.mirrored(set_at(2, 8'000));

  EXPECT_LT(late.set().exposed_at, early.set().exposed_at);
  EXPECT_EQ(early.set().exposed_at, from_ns(8'990));
  EXPECT_LT(late.number, early.number);
  EXPECT_LT(late.images[0].number, early.images[0].number);
  EXPECT_EQ(early.images[1].exposed_at - early.images[0].exposed_at, Duration(-20));
  EXPECT_EQ(early.images[0].received_at - early.images[0].exposed_at, Duration(5000)) << "a delay is no motion";
}

TEST(Mirror, IsItsOwnInverse) {
  const Mirror mirror(from_ns(1'000), from_ns(9'000));

  const OwnedSet twice = mirror.mirrored(mirror.mirrored(set_at(1, 1'000)));

  EXPECT_EQ(twice.number, 1U);
  EXPECT_EQ(twice.images[1].exposed_at, set_at(1, 1'000).images[1].exposed_at);
}

TEST(Mirror, ReversesVelocities) {
  Poses poses;
  BonePose& bone = poses.push_back({}).bones.push_back({});
  bone.velocity_m_s = {1.0, 0.0, 0.0};
  bone.spin_rad_s = {0.0, 2.0, 0.0};

  Mirror::unmirror(poses);

  EXPECT_EQ(poses[0].bones[0].velocity_m_s.x(), -1.0);
  EXPECT_EQ(poses[0].bones[0].spin_rad_s.y(), -2.0);
}

}  // namespace mirror_test
}  // namespace mocap::offline
