#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "solve/solve_world.h"

namespace mocap::solve {
namespace {

using World = test::SolveWorld;

/// How far off the wrist is, rms, over a second in which its markers are hidden but for one that one camera sees.
double wrist_off_m(World& world, bool by_ray, const std::vector<std::string>& hidden, const std::string& seen) {
  for (const std::string& name : hidden) world.show(world.marker(name), false);
  if (by_ray) world.see_by_ray(world.marker(seen), {-3.0, 2.5, 2.5});
  double sum = 0.0;
  for (int i = 0; i < 120; ++i) {
    world.step();
    sum += std::pow(world.off_m(world.bone("LeftHand")), 2);
  }
  return std::sqrt(sum / 120);
}

/// The same without a ray and with one, of somebody who moved before.
void expect_that_a_ray_helps(const std::function<World()>& moved, const std::vector<std::string>& hidden,
                             const std::string& seen) {
  World alone = moved();
  World held = moved();
  const double without = wrist_off_m(alone, false, hidden, seen);
  const double with = wrist_off_m(held, true, hidden, seen);

  EXPECT_GT(without, 0.05);
  EXPECT_LT(with, without / 3.0);
}

TEST(SolveRays, OneCamerasRayHoldsAHiddenHand) {
  const auto moved = [] {
    World world("openmocap18");
    world.step(120);
    return world;
  };
  expect_that_a_ray_helps(moved, {"LeftHand"}, "LeftHand");
}

TEST(SolveRays, OneCamerasRayHoldsAHandWithoutItsWrist) {
  const auto moved = [] {
    World world("baseline41");
    world.step(120);
    return world;
  };
  expect_that_a_ray_helps(moved, {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}, "LHandOut");
}

TEST(SolveRays, OneCamerasRayHoldsAHandThatIsThrownWhenItHides) {
  const auto moved = [] {
    World world("baseline41");
    world.step(110);
    world.pace(12.0);
    return world;
  };
  expect_that_a_ray_helps(moved, {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}, "LHandOut");
}

TEST(SolveRays, AMarkerOnARayIsFilledAndLiesOnIt) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  world.step(60);
  world.show(hand, false);
  world.see_by_ray(hand, eye);

  world.step(30);

  const LabelledMarker& label = world.label(hand);
  EXPECT_EQ(label.state, LabelState::Filled);
  EXPECT_EQ(label.cameras, 1U);
  const Eigen::Vector3d direction = (world.true_marker(hand) - eye).normalized();
  EXPECT_LT((label.position.v - eye).cross(direction).norm(), 1e-6);
  EXPECT_LT((label.position.v - world.true_marker(hand)).norm(), 0.03);
  // Known across the ray to some 0.5 mm, along it worse.
  EXPECT_GT(direction.dot(label.covariance_m2 * direction), 4.0 * 1e-4 * 1e-4 * 16.0);
}

TEST(SolveRays, DoesNotFollowARayThatPassesFarFromItsMarker) {
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  world.step(60);
  world.show(hand, false);
  // The ray of another place: it is named for the hand, and leads to the right foot.
  world.step(5);
  const double before = world.off_m(world.bone("LeftHand"));
  World other("openmocap18");
  other.step(60);
  other.show(hand, false);
  other.step(4);
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  const Eigen::Vector3d foot = other.true_marker(other.marker("RightFoot"));
  other.see_by_ray(hand, eye + 1e3 * (eye - foot) + 1e3 * (foot - other.true_marker(hand)));
  other.step();

  EXPECT_NEAR(other.off_m(other.bone("LeftHand")), before, 0.01);
}

// A hand is hidden but for what one camera sees; beside it something flashes for one set where a hidden marker may be.
TEST(SolveRays, AFlashThatIsNoMarkerTurnsNoHand) {
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  for (const double off_m : {-0.04, 0.04}) {
    World world("baseline41");
    world.step(120);
    for (const char* name : {"LWristIn", "LWristOut", "LHandIn", "LHandOut"}) world.show(world.marker(name), false);
    world.see_by_ray(world.marker("LHandOut"), eye);
    world.step(4);
    const std::size_t flash = world.marker("LHandIn");
    world.see_by_ray(flash, eye, {0.0, 0.0, off_m});
    world.step();
    world.see_no_more_by_ray(flash);
    world.step(12);

    const std::size_t hand = world.bone("LeftHand");
    EXPECT_LT(test::angle_between(world.shown(hand).world_from_bone.rotation, world.true_bone(hand).rotation), 0.05)
        << off_m;
  }
}

// The same camera sees it in the next set, too: it is a marker.
TEST(SolveRays, AMarkerThatOneCameraSeesAgainCountsFromItsSecondSetOn) {
  const Eigen::Vector3d eye(-3.0, 2.5, 2.5);
  World world("openmocap18");
  const std::size_t hand = world.marker("LeftHand");
  world.step(120);
  world.show(hand, false);
  world.step(6);
  world.see_by_ray(hand, eye);

  world.step();
  EXPECT_EQ(world.label(hand).cameras, 0U);
  world.step();
  EXPECT_EQ(world.label(hand).cameras, 1U);
}

}  // namespace
}  // namespace mocap::solve
