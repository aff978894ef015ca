#include "pose/initial_pose_solver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "kinematics/pose_fit.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace initial_pose_solver_test {

// rad, m: the markers have no noise, so only rounding remains where markers determine the pose.
constexpr double kRounding = 1e-6;

struct Body {
  Body(const MarkerSet& set, std::mt19937& random)
      : truth(set, kinematics::PoseFit::Lengths::Fixed), solved(set, kinematics::PoseFit::Lengths::Fixed) {
    truth.set_locals(test::random_pose(set, 0.8, random));
    locals.resize(set.skeleton.bones.size());
  }
  double rotation_error_rad(std::size_t bone) const {
    return test::angle_between(solved.world()[bone].rotation, truth.world()[bone].rotation);
  }

  kinematics::PoseFit truth, solved;
  std::vector<Pose> locals;
};

TEST(InitialPoseSolver, RecoversEachBoneThatItsMarkersDetermine) {
  std::mt19937 random(12);
  const MarkerSet set = test::person("baseline41");
  const kinematics::BoneShapes shapes(set);
  InitialPoseSolver solver(set);
  int determined = 0;
  for (int trial = 0; trial < 10; ++trial) {
    Body body(set, random);

    ASSERT_TRUE(solver.solve(set, test::see(body.truth), body.locals));

    body.solved.set_locals(body.locals);
    for (std::size_t b = 0; b < body.locals.size(); ++b) {
      if (!shapes.determines_rotation(b)) continue;
      ++determined;
      // The joint of the head depends on the neck, whose rotation one marker observes only in part.
      const double most_rad = set.skeleton.bones[b].name == "Head" ? 0.1 : kRounding;
      EXPECT_LT(body.rotation_error_rad(b), most_rad) << set.skeleton.bones[b].name;
    }
    EXPECT_LT((body.locals[0].position - body.truth.world()[0].position).norm(), kRounding);
  }
  EXPECT_EQ(determined, 50);  // hips, chest, head and both feet
}

TEST(InitialPoseSolver, PutsMostMarkersWithinCentimetresOfTheirPoints) {
  std::mt19937 random(13);
  const MarkerSet set = test::person("openmocap18");
  InitialPoseSolver solver(set);
  std::vector<double> errors_m;
  for (int trial = 0; trial < 20; ++trial) {
    Body body(set, random);

    ASSERT_TRUE(solver.solve(set, test::see(body.truth), body.locals));

    body.solved.set_locals(body.locals);
    for (std::size_t m = 0; m < set.markers.size(); ++m)
      errors_m.push_back((body.solved.marker_at(m) - body.truth.marker_at(m)).norm());
  }
  // An unobserved twist moves few markers; those that it moves are near the axis of the twist.
  std::ranges::sort(errors_m);
  EXPECT_LT(errors_m[errors_m.size() / 2], 0.01);
  EXPECT_LT(errors_m[errors_m.size() * 9 / 10], 0.10);
}

TEST(InitialPoseSolver, TwistsBonesTowardsTheRangesOfTheirJoints) {
  // The true pose lies within the ranges, so only twists that no marker observes exceed them.
  std::mt19937 random(17);
  const MarkerSet set = test::person("openmocap18");
  InitialPoseSolver solver(set);
  double excess_rad2 = 0.0;
  constexpr int kTrials = 20;
  for (int trial = 0; trial < kTrials; ++trial) {
    Body body(set, random);

    ASSERT_TRUE(solver.solve(set, test::see(body.truth), body.locals));

    for (std::size_t b = 1; b < body.locals.size(); ++b)
      excess_rad2 += squared_range_excess(set.skeleton.bones[b], body.locals[b].rotation);
  }
  EXPECT_LT(excess_rad2 / kTrials, 1e-3);  // 0.011 rad^2 without a choice of the twist
}

TEST(InitialPoseSolver, LeavesALimbWithoutMarkersInRestPose) {
  std::mt19937 random(14);
  const MarkerSet set = test::person("baseline41");
  InitialPoseSolver solver(set);
  Body body(set, random);
  const std::size_t hand = set.skeleton.bones.size() - 1;
  std::vector<kinematics::Observation> seen = test::see(body.truth);
  std::erase_if(seen, [&](const kinematics::Observation& one) {
    return set.markers[static_cast<std::size_t>(one.marker)].bone == static_cast<int>(hand);
  });
  ASSERT_LT(seen.size(), set.markers.size());

  ASSERT_TRUE(solver.solve(set, seen, body.locals));

  EXPECT_LT(test::angle_between(body.locals[hand].rotation, Eigen::Quaterniond::Identity()), kRounding);
}

TEST(InitialPoseSolver, NeedsThreeMarkersOfOneBoneOffALine) {
  std::mt19937 random(15);
  const MarkerSet set = test::person("baseline41");
  InitialPoseSolver solver(set);
  Body body(set, random);
  std::vector<kinematics::Observation> rays = test::see(body.truth), unknown = rays;
  for (kinematics::Observation& one : rays) one.bearing_only = true;
  for (kinematics::Observation& one : unknown) one.position.x() = std::nan("");

  EXPECT_FALSE(solver.solve(set, {}, body.locals));
  EXPECT_FALSE(solver.solve(set, rays, body.locals));
  EXPECT_FALSE(solver.solve(set, unknown, body.locals));
}

TEST(InitialPoseSolver, UsesTheOffsetsOfTheFittedBody) {
  std::mt19937 random(16);
  const MarkerSet file = test::person("baseline41");
  MarkerSet fitted = file;
  for (Bone& bone : fitted.skeleton.bones) bone.rest_offset_m *= 1.15;
  for (MarkerOnBone& marker : fitted.markers) marker.offset_m *= 1.1;
  InitialPoseSolver solver(file);
  Body body(fitted, random);

  ASSERT_TRUE(solver.solve(fitted, test::see(body.truth), body.locals));

  EXPECT_LT((body.locals[0].position - body.truth.world()[0].position).norm(), kRounding);
}

}  // namespace initial_pose_solver_test
}  // namespace mocap::pose
