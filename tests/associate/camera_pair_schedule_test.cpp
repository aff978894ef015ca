#include "associate/unassigned/camera_pair_schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <utility>

#include "support/marker_world.h"

namespace mocap::associate {
namespace camera_pair_schedule_test {

using Eigen::Vector3d;
using namespace mocap::test;

// By how much the angle between the cameras, seen from the point at which all cameras look, differs from 60 degrees.
double angle_error(const Rig& rig, const CameraPair& pair) {
  const Vector3d centre(0.0, 0.0, 1.0);
  const Vector3d to_a = (rig[pair.a].centre().v - centre).normalized();
  const Vector3d to_b = (rig[pair.b].centre().v - centre).normalized();
  return std::abs(std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b)) - std::numbers::pi / 3.0);
}

TEST(CameraPairSchedule, HasEachPairOnceAndEachCameraAtMostOnceARound) {
  for (const std::size_t cameras : {2U, 3U, 8U, 17U, 64U}) {
    const CameraPairSchedule schedule(ring(cameras));

    std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (std::size_t i = 0; i < schedule.size(); ++i) {
      EXPECT_FALSE(schedule.round(i).empty());
      std::set<std::uint32_t> busy;
      for (const CameraPair& pair : schedule.round(i)) {
        EXPECT_EQ(pair.round, i);
        EXPECT_LT(pair.a, pair.b);
        EXPECT_TRUE(busy.insert(pair.a).second && busy.insert(pair.b).second) << "round " << i;
        EXPECT_TRUE(pairs.emplace(pair.a, pair.b).second);
      }
    }
    EXPECT_EQ(pairs.size(), cameras * (cameras - 1) / 2);
    EXPECT_EQ(schedule.all().size(), pairs.size());
  }
}

TEST(CameraPairSchedule, BeginsWithThePairNearestToSixtyDegrees) {
  const Rig rig = ring(9);
  const CameraPairSchedule schedule(rig);
  const auto error = [&](const CameraPair& pair) { return angle_error(rig, pair); };

  const double best = error(schedule.all().front());

  for (const CameraPair& pair : schedule.all()) EXPECT_LE(best, error(pair) + 1e-6);  // rad: rounding
  // Each later pair had to wait, because a camera of it had a more suitable partner in each earlier round.
  for (const CameraPair& pair : schedule.all()) {
    for (std::size_t earlier = 0; earlier < pair.round; ++earlier) {
      const bool waits = std::ranges::any_of(schedule.round(earlier), [&](const CameraPair& other) {
        const bool meets = other.a == pair.a || other.a == pair.b || other.b == pair.a || other.b == pair.b;
        return meets && error(other) <= error(pair) + 1e-6;
      });
      EXPECT_TRUE(waits) << pair.a << " " << pair.b << " in round " << earlier;
    }
  }
}

TEST(CameraPairSchedule, MapsARayToItsEpipolarLine) {
  std::mt19937 random(3);
  const Rig rig = ring(5);
  const CameraPairSchedule schedule(rig);

  for (const Vector3d& marker : cloud(20, random)) {
    for (const CameraPair& pair : schedule.all()) {
      const auto ray = [&](std::uint32_t camera) {
        const Vector3d seen = (rig[camera].camera_from_world * WorldPoint{marker}).v;
        return Vector3d(seen / seen.z());
      };
      const Vector3d line = pair.essential * ray(pair.a);
      // On the image plane at distance 1: rounding.
      EXPECT_NEAR(line.dot(ray(pair.b)) / line.head<2>().norm(), 0.0, 1e-9);
    }
  }
}

TEST(CameraPairSchedule, IsEmptyForOneCameraAndToleratesParallelCameras) {
  Rig parallel = ring(1);
  EXPECT_EQ(CameraPairSchedule(parallel).size(), 0U);
  EXPECT_TRUE(CameraPairSchedule(parallel).all().empty());

  parallel = {camera_at({0.0, 0.0, 1.0}, {5.0, 0.0, 1.0}), camera_at({0.0, 1.0, 1.0}, {5.0, 1.0, 1.0})};
  const CameraPairSchedule schedule(parallel);

  ASSERT_EQ(schedule.size(), 1U);
  EXPECT_TRUE(schedule.all()[0].essential.allFinite());
}

}  // namespace camera_pair_schedule_test
}  // namespace mocap::associate
