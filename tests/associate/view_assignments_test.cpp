#include "associate/predicted/view_assignments.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <random>
#include <vector>

#include "support/marker_world.h"

namespace mocap::associate {
namespace view_assignments_test {

using namespace mocap::test;
using Eigen::Vector3d;

constexpr std::size_t kMarkers = 3;

/// Two views. The first marker has ray 0 in both; the second and the third share ray 1 of view 0.
struct TwoViews {
  TwoViews() : rig(ring(2)), rays(std::make_unique<RayTable>(rig)), assigned(kMarkers, 2) {
    world = see(rig, cloud(5, random), {.sigma_px = 0.1, .missed = 0.0}, random);
    rays->begin(world.set);
    assigned.begin(kMarkers, 2);
    std::array<RayAssignments, 2> of{RayAssignments(kMarkers), RayAssignments(kMarkers)};
    for (RayAssignments& view : of) {
      view.begin(kMarkers, kMaxBlobs);
      view.assign(0, 0);
    }
    of[0].assign(1, 1);
    for (const std::uint32_t marker : {1U, 2U}) of[0].assign_shared(marker, 1).sigma_px = 0.5F;
    of[0].assign_shared(1, 1).offset = {0.001F, 0.0F};
    std::vector<std::uint32_t> tracked_marker(kMaxBlobs, 0xFFFF'FFFF);
    tracked_marker[1] = 2;  // the 2D track of ray 1 belongs to the third marker
    for (std::size_t view = 0; view < 2; ++view) {
      rays->cast(view);
      assigned.set_view(view, (*rays)[view], of[view], tracked_marker, view == 0);
    }
  }

  std::mt19937 random{5};
  Rig rig;
  SeenWorld world;
  std::unique_ptr<RayTable> rays;
  ViewAssignments assigned;
};

TEST(ViewAssignments, ReturnTheRayOfAMarkerInEachView) {
  const TwoViews given;

  const AssignedRay whole = given.assigned.assigned(0, 1), shared_place = given.assigned.assigned(1, 0),
                    nothing = given.assigned.assigned(2, 1);

  EXPECT_EQ(whole.ray, 0U);
  EXPECT_EQ(whole.sigma_px, 0.0F);
  EXPECT_EQ(shared_place.ray, 1U);
  EXPECT_EQ(shared_place.offset.x(), 0.001F);
  EXPECT_EQ(nothing.ray, AssignedRay::kNone);
  EXPECT_EQ(given.assigned(1, 0).sigma_px, 0.5F);
  EXPECT_EQ(given.assigned(0, 0).sigma_px, static_cast<float>((*given.rays)[0].sigma_px[0]));
  EXPECT_FALSE(given.assigned(1, 0).by_track);
  EXPECT_TRUE(given.assigned(2, 0).by_track);
}

TEST(RayAssignments, ReturnTheMarkerOfARayUntilTheRayIsReleased) {
  RayAssignments assigned(3);
  assigned.begin(3, 4);
  assigned.assign(1, 2);
  assigned.assign_shared(2, 2).sigma_px = 0.5F;
  const std::uint32_t assigned_marker = assigned.assigned_marker(2);

  assigned.release(1);

  EXPECT_EQ(assigned_marker, 1U);
  EXPECT_EQ(assigned.assigned_marker(2), AssignedRay::kNone);
  EXPECT_EQ(assigned.rays()[1], AssignedRay::kNone);
  EXPECT_EQ(assigned.rays()[2], 2U);
  EXPECT_EQ(assigned.shared_markers().size(), 1U);
  assigned.begin(3, 4);
  EXPECT_EQ(assigned.rays()[2], AssignedRay::kNone);
  EXPECT_TRUE(assigned.shared_places().empty());
}

TEST(ViewAssignments, LeaveASharedRayToTheOtherMarkerAfterARelease) {
  TwoViews given;
  ASSERT_TRUE(given.assigned.has_exclusive_ray(0));
  ASSERT_FALSE(given.assigned.has_exclusive_ray(1));
  ASSERT_FALSE(given.assigned.has_exclusive_ray(2));

  given.assigned.release_all(2);

  EXPECT_FALSE(given.assigned(2, 0).has_ray());
  EXPECT_TRUE(given.assigned.has_exclusive_ray(1));
}

TEST(ViewRays, SetsTheUseCountsOfAllRays) {
  TwoViews given;
  ViewRays& view = (*given.rays)[0];
  ASSERT_GE(view.size(), 4U);

  view.set_use_counts(given.assigned.use_counts(0));
  given.assigned.unassign(2, 0);
  for (const auto& [of_view, ray] : given.assigned.released()) (*given.rays)[of_view].decrement_use(ray);

  EXPECT_EQ(view.use_count[0], 1);
  EXPECT_EQ(view.use_count[1], 1);
  EXPECT_EQ(view.use_count[2], 0);
  EXPECT_EQ(view.unassigned_count(), view.size() - 2);
}

}  // namespace view_assignments_test
}  // namespace mocap::associate
