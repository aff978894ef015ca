#include "identify/shape_ambiguity.h"

#include <gtest/gtest.h>

#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace {

constexpr double kTolerance_m = 0.012;

MarkerSet thing(const std::vector<Eigen::Vector3d>& places_m) {
  MarkerSet set;
  set.skeleton.bones.push_back({});
  for (const Eigen::Vector3d& place : places_m) set.markers.push_back({"m", 0, place, {}});
  return set;
}

TEST(SameShape, ATurnedAndReorderedThingIsMistakenForTheFirst) {
  const MarkerSet first = test::person("rigid4");
  MarkerSet second = first;
  const Eigen::Quaterniond turn = kinematics::from_rotation_vector({0.4, -1.0, 2.0});
  for (MarkerOnBone& marker : second.markers) marker.offset_m = turn * marker.offset_m + Eigen::Vector3d(0.1, 0.2, 0.3);
  std::swap(second.markers[0], second.markers[2]);

  const auto mistaken = find_shape_ambiguity(first, second, kTolerance_m);

  ASSERT_TRUE(mistaken);
  EXPECT_EQ(*mistaken, (MarkerCorrespondence{2, 1, 0, 3}));
}

TEST(SameShape, AMirrorImageIsAnotherThing) {
  const MarkerSet first = test::person("rigid4");
  MarkerSet second = first;
  for (MarkerOnBone& marker : second.markers) marker.offset_m.y() = -marker.offset_m.y();

  EXPECT_FALSE(find_shape_ambiguity(first, second, kTolerance_m));
}

TEST(SameShape, AThingThatStandsInALargerOneIsMistakenForIt) {
  const MarkerSet larger = test::person("rigid4");
  MarkerSet part = larger;
  part.markers.erase(part.markers.begin());

  EXPECT_TRUE(find_shape_ambiguity(part, larger, kTolerance_m));
  EXPECT_FALSE(find_shape_ambiguity(larger, part, kTolerance_m));
}

TEST(SameShape, AThingIsMistakenForItselfOnlyWhereItIsSymmetric) {
  const MarkerSet lopsided = test::person("rigid4");
  const MarkerSet isosceles = thing({{0.0, 0.0, 0.0}, {0.1, 0.05, 0.0}, {0.1, -0.05, 0.0}});

  EXPECT_FALSE(find_shape_ambiguity(lopsided, lopsided, kTolerance_m));
  EXPECT_TRUE(find_shape_ambiguity(isosceles, isosceles, kTolerance_m));
}

TEST(SameShape, BodiesAreTheSameUntilABoneOrAMarkerIsElsewhere) {
  const MarkerSet one = test::person("baseline41");
  MarkerSet longer = one;
  longer.skeleton.bones[5].rest_offset_m *= 1.3;
  MarkerSet moved = one;
  moved.markers[7].offset_m.z() += 0.05;

  EXPECT_TRUE(is_same_body(one, one, kTolerance_m));
  EXPECT_FALSE(is_same_body(one, longer, kTolerance_m));
  EXPECT_FALSE(is_same_body(one, moved, kTolerance_m));
}

}  // namespace
}  // namespace mocap::identify
