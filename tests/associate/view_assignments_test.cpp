#include "associate/predicted/view_assignments.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <vector>

#include "support/marker_world.h"

namespace mocap::associate {
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
    std::array<ViewHolds, 2> of{ViewHolds(kMarkers), ViewHolds(kMarkers)};
    for (ViewHolds& view : of) {
      view.begin(kMarkers, kMaxBlobs);
      view.hold(0, 0);
    }
    of[0].hold(1, 1);
    for (const std::uint32_t marker : {1U, 2U}) of[0].share(marker, 1).sigma_px = 0.5F;
    of[0].share(1, 1).off = {0.001F, 0.0F};
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

TEST(ViewHolds, TellTheHolderOfARayUntilItLetsGo) {
  ViewHolds holds(3);
  holds.begin(3, 4);
  holds.hold(1, 2);
  holds.share(2, 2).sigma_px = 0.5F;
  const std::uint32_t holder = holds.holder(2);

  holds.let_go(1);

  EXPECT_EQ(holder, 1U);
  EXPECT_EQ(holds.holder(2), Held::kNone);
  EXPECT_EQ(holds.rays()[1], Held::kNone);
  EXPECT_EQ(holds.rays()[2], 2U);
  EXPECT_EQ(holds.sharers().size(), 1U);
  holds.begin(3, 4);
  EXPECT_EQ(holds.rays()[2], Held::kNone);
  EXPECT_TRUE(holds.places().empty());
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

TEST(ViewRays, TakesAllRaysThatAreHeldByAsMany) {
  TwoViews given;
  ViewRays& view = (*given.rays)[0];
  ASSERT_GE(view.size(), 4U);

  view.take_all(given.held.holders(0));
  given.held.drop(2, 0);
  for (const auto& [of_view, ray] : given.held.given_up()) (*given.rays)[of_view].give_back(ray);

  EXPECT_EQ(view.taken[0], 1);
  EXPECT_EQ(view.taken[1], 1);
  EXPECT_EQ(view.taken[2], 0);
  EXPECT_EQ(view.free_count(), view.size() - 2);
}

}  // namespace
}  // namespace mocap::associate
