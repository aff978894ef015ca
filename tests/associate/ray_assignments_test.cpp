#include "associate/predicted/ray_assignments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace mocap::associate {
namespace ray_assignments_test {

constexpr std::uint32_t kNone = RayAssignments::kNone;

std::vector<std::uint32_t> rays_of(const RayAssignments& assignments) {
  return {assignments.rays().begin(), assignments.rays().end()};
}

TEST(RayAssignments, KnowTheRayOfAMarkerAndTheMarkerOfARay) {
  RayAssignments assignments(10);
  assignments.begin(3, 5);

  assignments.assign(0, 4);
  assignments.assign(2, 1);

  EXPECT_EQ(rays_of(assignments), (std::vector<std::uint32_t>{4, kNone, 1}));
  EXPECT_EQ(assignments.assigned_marker(4), 0U);
  EXPECT_EQ(assignments.assigned_marker(1), 2U);
  EXPECT_EQ(assignments.assigned_marker(0), kNone);
}

TEST(RayAssignments, ReleaseOneMarkerAndNoOther) {
  RayAssignments assignments(10);
  assignments.begin(3, 5);
  assignments.assign(0, 4);
  assignments.assign(2, 1);

  assignments.release(0);

  EXPECT_EQ(rays_of(assignments), (std::vector<std::uint32_t>{kNone, kNone, 1}));
  EXPECT_EQ(assignments.assigned_marker(4), kNone);
  EXPECT_EQ(assignments.assigned_marker(1), 2U);
}

TEST(RayAssignments, GiveASharedRayToSeveralMarkersEachWithItsPosition) {
  RayAssignments assignments(10);
  assignments.begin(3, 5);
  assignments.assign(0, 2);

  assignments.assign_shared(0, 2).offset = {0.1F, 0.0F};
  assignments.assign_shared(1, 2).offset = {-0.1F, 0.0F};

  EXPECT_EQ(rays_of(assignments), (std::vector<std::uint32_t>{2, 2, kNone}));
  EXPECT_EQ(assignments.assigned_marker(2), 0U);
  ASSERT_TRUE(std::ranges::equal(assignments.shared_markers(), std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(assignments.shared_places()[0].offset.x(), 0.1F);
  EXPECT_EQ(assignments.shared_places()[1].offset.x(), -0.1F);
  EXPECT_EQ(assignments.shared_places()[1].ray, 2U);
}

TEST(RayAssignments, KeepOnePositionForAMarkerThatIsSharedTwice) {
  RayAssignments assignments(10);
  assignments.begin(3, 5);
  assignments.assign_shared(1, 2).offset = {0.1F, 0.0F};

  const AssignedRay& again = assignments.assign_shared(1, 3);

  EXPECT_EQ(again.ray, 3U);
  EXPECT_EQ(again.offset.x(), 0.1F);
  EXPECT_EQ(assignments.shared_markers().size(), 1U);
}

TEST(RayAssignments, ForgetThePreviousView) {
  RayAssignments assignments(10);
  assignments.begin(3, 5);
  assignments.assign(0, 4);
  assignments.assign_shared(1, 2).offset = {0.1F, 0.0F};

  assignments.begin(4, 5);

  EXPECT_EQ(rays_of(assignments), std::vector<std::uint32_t>(4, kNone));
  for (std::size_t ray = 0; ray < 5; ++ray) EXPECT_EQ(assignments.assigned_marker(ray), kNone);
  EXPECT_TRUE(assignments.shared_markers().empty());
  EXPECT_TRUE(assignments.shared_places().empty());
  EXPECT_EQ(assignments.assign_shared(1, 0).offset.x(), 0.0F);
}

}  // namespace ray_assignments_test
}  // namespace mocap::associate
