#include "stages/held_views.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <vector>

#include "support/marker_world.h"

namespace mocap::stages {
namespace {

using namespace mocap::test;
using Eigen::Vector3d;

constexpr std::size_t kMarkers = 3;

/// Two views of markers: of the first both have ray 0, the second shares ray 1 of view 0 with the third.
struct TwoViews {
  TwoViews() : rig(ring(2)), rays(std::make_unique<RayTable>(rig)), held(kMarkers, 2) {
    world = see(rig, cloud(5, random), {.sigma_px = 0.1, .missed = 0.0}, random);
    rays->begin(world.set);
    held.begin(kMarkers, 2);
    std::array<std::vector<Held>, 2> of{std::vector<Held>(kMarkers), std::vector<Held>(kMarkers)};
    of[0][0].ray = of[1][0].ray = 0;
    of[0][1].ray = of[0][2].ray = 1;
    of[0][1].sigma_px = of[0][2].sigma_px = 0.5F;
    of[0][1].off = {0.001F, 0.0F};
    std::vector<std::uint32_t> owner(kMaxBlobs, 0xFFFF'FFFF);
    owner[1] = 2;  // the third's by its 2D track
    for (std::size_t view = 0; view < 2; ++view) {
      rays->cast(view);
      held.keep(view, (*rays)[view], of[view], owner, view == 0);
    }
  }

  std::mt19937 random{5};
  Rig rig;
  SeenWorld world;
  std::unique_ptr<RayTable> rays;
  HeldViews held;
};

TEST(HeldViews, TellWhatEachViewHoldsOfAMarker) {
  const TwoViews given;

  const Held whole = given.held.held(0, 1), place = given.held.held(1, 0), nothing = given.held.held(2, 1);

  EXPECT_EQ(whole.ray, 0U);
  EXPECT_EQ(whole.sigma_px, 0.0F);
  EXPECT_EQ(place.ray, 1U);
  EXPECT_EQ(place.off.x(), 0.001F);
  EXPECT_EQ(nothing.ray, Held::kNone);
  EXPECT_EQ(given.held(1, 0).sigma_px, 0.5F);
  EXPECT_EQ(given.held(0, 0).sigma_px, static_cast<float>((*given.rays)[0].sigma_px[0]));
  EXPECT_FALSE(given.held(1, 0).own);
  EXPECT_TRUE(given.held(2, 0).own);
}

TEST(HeldViews, LeaveASharedRayToTheOtherWhenOneForsakesIt) {
  TwoViews given;
  ASSERT_TRUE(given.held.has_own_ray(0));
  ASSERT_FALSE(given.held.has_own_ray(1));
  ASSERT_FALSE(given.held.has_own_ray(2));

  given.held.forsake(2);

  EXPECT_FALSE(given.held(2, 0).has_ray());
  EXPECT_TRUE(given.held.has_own_ray(1));
}

TEST(ViewRays, TakesManyRaysAsItTakesThemOneByOne) {
  TwoViews given;
  ViewRays& view = (*given.rays)[0];
  ASSERT_GE(view.size(), 4U);
  const std::array<std::uint32_t, 4> wanted{3, 0xFFFF'FFFF, 1, 3};

  view.take_all(wanted.size(), [&](std::size_t i) { return wanted[i]; });

  EXPECT_EQ(view.taken[3], 2);
  EXPECT_EQ(view.taken[1], 1);
  EXPECT_EQ(view.taken[0], 0);
  EXPECT_EQ(view.free_count(), view.size() - 2);
}

}  // namespace
}  // namespace mocap::stages
