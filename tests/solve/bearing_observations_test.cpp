#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "solve/solve_world.h"

namespace mocap::solve {
namespace bearing_observations_test {

using World = test::SolveWorld;

/// Rms error of the wrist over a second in which its markers are hidden; with a ray, one camera observes `seen`.
double wrist_error_m(World& world, bool with_ray, const std::vector<std::string>& hidden, const std::string& seen) {
  for (const std::string& name : hidden) world.show(world.marker(name), false);
  if (with_ray) world.observe_by_ray(world.marker(seen), {-3.0, 2.5, 2.5});
  double sum = 0.0;
  for (int i = 0; i < 120; ++i) {
    world.step();
    sum += std::pow(world.error_m(world.bone("LeftHand")), 2);
  }
  return std::sqrt(sum / 120);
}

/// Expects at most a third of the error with a ray. `moved` makes a person in motion.
void expect_that_a_ray_reduces_the_error(const std::function<World()>& moved, const std::vector<std::string>& hidden,
                                         const std::string& seen) {
  World without_ray = moved();
  World with_ray = moved();
  const double without = wrist_error_m(without_ray, false, hidden, seen);
  const double with = wrist_error_m(with_ray, true, hidden, seen);

  EXPECT_GT(without, 0.05);
  EXPECT_LT(with, without / 3.0);
}

TEST(BearingOnlyObservation, ReducesTheErrorOfAHiddenHand) {
  const auto moved = [] {
    World world("openmocap18");
    world.step(120);
    return world;
  };
  expect_that_a_ray_reduces_the_error(moved, {"LeftHand"}, "LeftHand");
}

TEST(BearingOnlyObservation, ReducesTheErrorOfAHandWithHiddenWrist) {
  const auto moved = [] {
    World world("baseline41");
    world.step(120);
    return world;
  };
  expect_that_a_ray_reduces_the_error(moved, {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}, "LHandOut");
}

TEST(BearingOnlyObservation, ReducesTheErrorOfAFastHandThatBecomesHidden) {
  const auto moved = [] {
    World world("baseline41");
    world.step(110);
    world.pace(12.0);
    return world;
  };
  expect_that_a_ray_reduces_the_error(moved, {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}, "LHandOut");
}

TEST(BearingOnlyObservation, FillsTheMarkerOnItsRay) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  world.step(60);
  world.show(hand, false);
  world.observe_by_ray(hand, eye);

  world.step(30);

  const LabelledMarker& label = world.label(hand);
  EXPECT_EQ(label.state, LabelState::Filled);
  EXPECT_EQ(label.cameras, 1U);
  EXPECT_EQ(label.seen_by, bit_of(CameraId{3}));
  const Eigen::Vector3d direction = (world.true_marker(hand) - eye).normalized();
  EXPECT_LT((label.position.v - eye).cross(direction).norm(), 1e-6);
  EXPECT_LT((label.position.v - world.true_marker(hand)).norm(), 0.03);
  // The standard deviation is 0.5 mm across the ray, and larger along it.
  EXPECT_GT(direction.dot(label.covariance_m2 * direction), 4.0 * 1e-4 * 1e-4 * 16.0);
}

TEST(BearingOnlyObservation, IsRejectedFarFromItsMarker) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  world.step(60);
  world.show(hand, false);
  // The ray has the label of the hand but passes through the right foot.
  world.step(5);
  const double before = world.error_m(world.bone("LeftHand"));
  World other("openmocap18");
  other.step(60);
  other.show(hand, false);
  other.step(4);
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  const Eigen::Vector3d foot = other.true_marker(other.marker("RightFoot"));
  other.observe_by_ray(hand, eye + 1e3 * (eye - foot) + 1e3 * (foot - other.true_marker(hand)));
  other.step();

  EXPECT_NEAR(other.error_m(other.bone("LeftHand")), before, 0.01);
}

// One camera observes one marker of a hidden hand. For one set it also detects a false blob near a hidden marker.
TEST(BearingOnlyObservation, OfOneSetRotatesNoHand) {
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  for (const double off_m : {-0.04, 0.04}) {
    World world("baseline41");
    world.step(120);
    for (const char* name : {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}) world.show(world.marker(name), false);
    world.observe_by_ray(world.marker("LHandOut"), eye);
    world.step(4);
    const std::size_t false_blob = world.marker("LHandIn");
    world.observe_by_ray(false_blob, eye, {0.0, 0.0, off_m});
    world.step();
    world.end_ray(false_blob);
    world.step(12);

    const std::size_t hand = world.bone("LeftHand");
    EXPECT_LT(test::angle_between(world.published(hand).world_from_bone.rotation, world.true_bone(hand).rotation), 0.05)
        << off_m;
  }
}

// The same camera observes the marker in the next set, too.
TEST(BearingOnlyObservation, CountsFromItsSecondSetOn) {
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  world.step(120);
  world.show(hand, false);
  world.step(6);
  world.observe_by_ray(hand, eye);

  world.step();
  EXPECT_EQ(world.label(hand).cameras, 0U);
  world.step();
  EXPECT_EQ(world.label(hand).cameras, 1U);
}

}  // namespace bearing_observations_test
}  // namespace mocap::solve
