#include "identify/asymmetry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "identify/front_back_ambiguity.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace asymmetry_test {

using test::person;

using Names = std::vector<std::pair<std::string, std::string>>;

Names names_of(const MarkerSet& set, const std::vector<MarkerPair>& pairs) {
  Names names;
  for (const auto& [one, other] : pairs) names.emplace_back(set.markers[one].name, set.markers[other].name);
  return names;
}

TEST(OppositeBones, AreLeftForRightAndTheBoneItselfIfCentral) {
  const Skeleton skeleton = person("baseline51").skeleton;

  const std::vector<int> opposite = opposite_bones(skeleton);

  for (std::size_t b = 0; b < skeleton.bones.size(); ++b) {
    std::string name = skeleton.bones[b].name;
    if (name.starts_with("Left"))
      name.replace(0, 4, "Right");
    else if (name.starts_with("Right"))
      name.replace(0, 5, "Left");
    ASSERT_GE(opposite[b], 0) << name;
    EXPECT_EQ(skeleton.bones[static_cast<std::size_t>(opposite[b])].name, name);
  }
}

TEST(OppositeBones, AreNoneIfNoJointIsAMirrorImage) {
  Skeleton skeleton;
  skeleton.bones.resize(2);
  skeleton.bones[1].parent = 0;
  skeleton.bones[1].rest_offset_m = {0.0, 0.2, 0.0};

  EXPECT_EQ(opposite_bones(skeleton), (std::vector<int>{0, -1}));
}

TEST(OppositeMarkers, HaveNamesThatDifferInTheSideOnly) {
  const MarkerSet set = person("baseline41");

  const Names names = names_of(set, opposite_markers(set));

  EXPECT_EQ(names.size(), 18U);  // all markers except three of the head, the chest and the top of the back
  for (const auto& pair : Names{{"LThigh", "RThigh"}, {"WaistLFront", "WaistRFront"}, {"BackLeft", "BackRight"}})
    EXPECT_EQ(std::count(names.begin(), names.end(), pair), 1) << pair.first;
}

TEST(Asymmetry, IsTheOffsetFromTheMirrorImageSeenFromTheFront) {
  EXPECT_TRUE(asymmetry_m({0.04, 0.07, -0.2}, {0.01, -0.07, -0.2}).isZero());
  EXPECT_TRUE(asymmetry_m({0.04, 0.07, -0.19}, {0.01, -0.09, -0.25}).isApprox(Eigen::Vector3d(0.0, -0.02, 0.06)));
}

TEST(Asymmetry, ChangesSignIfTheBodyIsIdentifiedBackToFront) {
  const Eigen::Vector3d left(0.04, 0.17, 0.9), right(-0.01, -0.18, 0.85);
  const auto turned = [](const Eigen::Vector3d& place) { return Eigen::Vector3d(-place.x(), -place.y(), place.z()); };

  EXPECT_TRUE(asymmetry_m(turned(right), turned(left)).isApprox(-asymmetry_m(left, right)));
}

TEST(ShippedMarkerSets, ListAllAsymmetricPairs) {
  for (const char* name : {"openmocap18", "baseline41", "baseline47", "baseline51", "baseline61", "pluginGait39"}) {
    const MarkerSet set = person(name);
    EXPECT_EQ(names_of(set, set.asymmetric), names_of(set, asymmetric_markers(set))) << name;
  }
}

TEST(WithAsymmetries, MovesAsymmetricPairsToTheirFittedOffsetsOnly) {
  const MarkerSet set = test::sparse_person(0.0);
  bodyfit::FittedSubject fitted{
      .marker_set = test::sparse_person(0.04), .size = 1.1, .residuals = {}, .from_rest = true};
  for (MarkerOnBone& marker : fitted.marker_set.markers) marker.offset_m *= 1.1;
  fitted.marker_set.markers[0].offset_m.x() += 0.05;

  const MarkerSet result = with_asymmetries(set, fitted);

  EXPECT_EQ(names_of(result, result.asymmetric),
            (Names{{"LUArmHigh", "RUArmHigh"}, {"LThigh", "RThigh"}, {"LShin", "RShin"}}));
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    const Eigen::Vector3d expected = test::sparse_person(0.04).markers[m].offset_m;
    EXPECT_TRUE(result.markers[m].offset_m.isApprox(expected)) << set.markers[m].name;
  }

  fitted.from_rest = false;
  EXPECT_TRUE(with_asymmetries(set, fitted).asymmetric.empty());
}

TEST(FrontBackAmbiguity, ExistsIfOnlyLimbMarkersDistinguishTheFrontAndNoPairIsAsymmetric) {
  for (const char* name : {"openmocap18", "baseline41", "baseline47", "baseline51", "baseline61", "pluginGait39"})
    EXPECT_FALSE(has_front_back_ambiguity(person(name), {})) << name;
  EXPECT_TRUE(has_front_back_ambiguity(test::sparse_person(0.0), {}));

  MarkerSet asymmetric = test::sparse_person(0.04);
  EXPECT_TRUE(has_front_back_ambiguity(asymmetric, {}));
  asymmetric.asymmetric = asymmetric_markers(asymmetric);
  EXPECT_FALSE(has_front_back_ambiguity(asymmetric, {}));
}

}  // namespace asymmetry_test
}  // namespace mocap::identify
