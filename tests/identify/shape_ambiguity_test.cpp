#include "identify/shape_ambiguity.h"

#include <gtest/gtest.h>

#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace shape_ambiguity_test {

constexpr double kTolerance_m = 0.012;

MarkerSet rigid_body(const std::vector<Eigen::Vector3d>& offsets_m) {
  MarkerSet set;
  set.skeleton.bones.push_back({});
  for (const Eigen::Vector3d& offset : offsets_m) set.markers.push_back({"m", 0, offset, {}});
  return set;
}

TEST(ShapeAmbiguity, ExistsForARotatedAndReorderedBody) {
  const MarkerSet first = test::person("rigid4");
  MarkerSet second = first;
  const Eigen::Quaterniond rotation = kinematics::from_rotation_vector({0.4, -1.0, 2.0});
  for (MarkerOnBone& marker : second.markers)
    marker.offset_m = rotation * marker.offset_m + Eigen::Vector3d(0.1, 0.2, 0.3);
  std::swap(second.markers[0], second.markers[2]);

  const auto correspondence = find_shape_ambiguity(first, second, kTolerance_m);

  ASSERT_TRUE(correspondence);
  EXPECT_EQ(*correspondence, (MarkerCorrespondence{2, 1, 0, 3}));
}

TEST(ShapeAmbiguity, DoesNotExistForAMirrorImage) {
  const MarkerSet first = test::person("rigid4");
  MarkerSet second = first;
  for (MarkerOnBone& marker : second.markers) marker.offset_m.y() = -marker.offset_m.y();

  EXPECT_FALSE(find_shape_ambiguity(first, second, kTolerance_m));
}

TEST(ShapeAmbiguity, ExistsForAPartOfALargerBodyButNotTheOtherWay) {
  const MarkerSet larger = test::person("rigid4");
  MarkerSet part = larger;
  part.markers.erase(part.markers.begin());

  EXPECT_TRUE(find_shape_ambiguity(part, larger, kTolerance_m));
  EXPECT_FALSE(find_shape_ambiguity(larger, part, kTolerance_m));
}

TEST(ShapeAmbiguity, OfABodyWithItselfExistsOnlyIfTheBodyIsSymmetric) {
  const MarkerSet asymmetric = test::person("rigid4");
  const MarkerSet isosceles = rigid_body({{0.0, 0.0, 0.0}, {0.1, 0.05, 0.0}, {0.1, -0.05, 0.0}});

  EXPECT_FALSE(find_shape_ambiguity(asymmetric, asymmetric, kTolerance_m));
  EXPECT_TRUE(find_shape_ambiguity(isosceles, isosceles, kTolerance_m));
}

TEST(SameBody, NeedsEqualBonesAndMarkers) {
  const MarkerSet one = test::person("baseline41");
  MarkerSet longer = one;
  longer.skeleton.bones[5].rest_offset_m *= 1.3;
  MarkerSet moved = one;
  moved.markers[7].offset_m.z() += 0.05;

  EXPECT_TRUE(is_same_body(one, one, kTolerance_m));
  EXPECT_FALSE(is_same_body(one, longer, kTolerance_m));
  EXPECT_FALSE(is_same_body(one, moved, kTolerance_m));
}

}  // namespace shape_ambiguity_test
}  // namespace mocap::identify
