#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "solve/solve_world.h"
#include "support/archived.h"

namespace mocap::solve {
namespace archive_test {

using test::archived;
using test::take_over;
using World = test::SolveWorld;

void expect_equal_poses(const SubjectPose& one, const SubjectPose& other, int set) {
  ASSERT_EQ(one.bones.size(), other.bones.size()) << set;
  ASSERT_EQ(one.residual_m, other.residual_m) << set;
  ASSERT_EQ(one.smoothing_delay_s, other.smoothing_delay_s) << set;
  for (std::size_t b = 0; b < one.bones.size(); ++b) {
    const BonePose &bone = one.bones[b], &twin = other.bones[b];
    ASSERT_EQ(bone.state, twin.state) << set;
    ASSERT_EQ(bone.confidence, twin.confidence) << set;
    ASSERT_EQ(bone.world_from_bone.position, twin.world_from_bone.position) << set;
    ASSERT_EQ(bone.world_from_bone.rotation.coeffs(), twin.world_from_bone.rotation.coeffs()) << set;
    ASSERT_EQ(bone.parent_from_bone.rotation.coeffs(), twin.parent_from_bone.rotation.coeffs()) << set;
    ASSERT_EQ(bone.velocity_m_s, twin.velocity_m_s) << set;
    ASSERT_EQ(bone.spin_rad_s, twin.spin_rad_s) << set;
  }
}

void expect_equal_labels(const World& world, const Labels& other, int set) {
  for (std::size_t m = 0; m < other[0].markers.size(); ++m) {
    const LabelledMarker &label = world.label(m), &twin = other[0].markers[m];
    ASSERT_EQ(label.state, twin.state) << set;
    ASSERT_EQ(label.confidence, twin.confidence) << set;
    ASSERT_EQ(label.position.v, twin.position.v) << set;
    ASSERT_EQ(label.covariance_m2, twin.covariance_m2) << set;
  }
}

// The markers of the left arm hide and return, but for one ray.
void hide_left_arm(World& world, bool hidden) {
  for (std::size_t m = 0; m < world.set().markers.size(); ++m) {
    const auto& bone = world.set().skeleton.bones[static_cast<std::size_t>(world.set().markers[m].bone)].name;
    if (bone.starts_with("Left") && (bone.ends_with("Arm") || bone.ends_with("Hand"))) world.show(m, !hidden);
  }
  const std::size_t wrist = world.marker("LWristOut");
  hidden ? world.observe_by_ray(wrist, {5.0, 1.0, 2.0}) : world.end_ray(wrist);
}

// A solver that is replaced after each set by a new one with its belief gives the same results.
TEST(Archive, LetsASolverContinueAfterEachSet) {
  const SolveSettings settings{.smoothing = {.min_cutoff_hz = 3.0}};
  World world("baseline41", settings);
  world.noise(0.0005);
  const auto fresh = [&] { return make_skeleton_solver(settings, {{"actor", world.set(), true}}); };
  std::unique_ptr<SkeletonSolver> other = fresh();
  for (int set = 0; set < 240; ++set) {
    if (set % 60 == 20 || set % 60 == 50) hide_left_arm(world, set % 60 == 20);
    world.step();
    const auto& [labels, poses] = other->solve(world.given(), world.at(), world.bearings());
    expect_equal_poses(world.pose(), poses[0], set);
    expect_equal_labels(world, labels, set);

    if (set % 45 == 30) world.refit();  // takes effect in the next set
    const std::vector<std::byte> belief = archived(world.solver());
    other = fresh();
    ASSERT_TRUE(take_over(belief, *other)) << set;
  }
}

}  // namespace archive_test
}  // namespace mocap::solve
