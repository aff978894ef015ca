#include <gtest/gtest.h>

#include <vector>

#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace unreliable_bones_test {

using test::bone_named;
using test::marker_named;
using test::person;
using test::see;
using test::without;

Timestamp at(int set) { return from_ns(1'000'000'000) + from_s(set / 60.0); }

// Distance, m, of the left hand's marker from the fitted pose when the marker returns after ten sets, with the forearm
// turned by 143 degrees from where the tracker takes it to be.
double residual_of_the_hand(const std::vector<const char*>& unreliable) {
  const MarkerSet set = person("openmocap18");
  const std::size_t hand = marker_named(set, "LeftHand");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(
      set,
      {.outlier_m = 0.02, .max_iterations = 4, .observability_prior_rad = 0.15, .rest_prior_time_constant_s = 0.0});
  EXPECT_TRUE(body.start(without(see(truth), hand), at(0)));
  for (int step = 1; step < 10; ++step) {
    body.predict(at(step));
    (void)body.update(without(see(truth), hand));
    body.commit(without(see(truth), hand));
  }
  std::vector<Pose> bent(truth.locals().begin(), truth.locals().end());
  bent[static_cast<std::size_t>(bone_named(set, "LeftLowArm"))].rotation =
      kinematics::from_rotation_vector({0.0, 2.165, 1.25});
  truth.set_locals(bent);
  std::vector<char> flags(set.skeleton.bones.size());
  for (const char* name : unreliable) flags[static_cast<std::size_t>(bone_named(set, name))] = 1;

  body.predict(at(10));
  body.mark_unreliable(flags);
  (void)body.update(see(truth));
  return (body.predicted_position(hand) - truth.marker_at(hand)).norm();
}

TEST(UnreliableBones, FollowAMarkerFarFromThePrediction) {
  EXPECT_GT(residual_of_the_hand({}), 0.1);
  EXPECT_LT(residual_of_the_hand({"LeftLowArm"}), 0.01);
}

TEST(UnreliableBones, IncludeTheParentOfABoneWhoseMarkerSitsInItsJoint) {
  EXPECT_LT(residual_of_the_hand({"LeftHand"}), 0.01);
}

}  // namespace unreliable_bones_test
}  // namespace mocap::pose
