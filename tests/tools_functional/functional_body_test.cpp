#include "lib/functional/functional_body.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test_motion.h"

namespace mocap::functional {
namespace functional_body_test {

using test_motion::Gymnast;

std::vector<std::string> names_of(const MarkerSet& set) {
  std::vector<std::string> names;
  for (const MarkerOnBone& marker : set.markers) names.push_back(marker.name);
  return names;
}

const MarkerOnBone& marker_of(const MarkerSet& set, const std::string& name) {
  return set.markers[test::marker_named(set, name)];
}

// Where the joint of a marker's bone is in the world, by the fit of the found body to a frame.
Eigen::Vector3d joint_place(const MarkerSet& found, const std::string& marker, const MarkerSet& truth_set,
                            const kinematics::PoseFit& truth) {
  kinematics::PoseFit body(found, kinematics::PoseFit::Lengths::Fixed);
  std::vector<kinematics::Observation> seen;
  for (std::size_t m = 0; m < found.markers.size(); ++m) {
    seen.push_back({static_cast<int>(m), truth.marker_at(test::marker_named(truth_set, found.markers[m].name)), 0.003});
  }
  body.place({});
  (void)body.solve(seen, {}, 200);
  return body.world()[static_cast<std::size_t>(marker_of(found, marker).bone)].position;
}

TEST(FunctionalBody, HasTheSegmentsAndJointsOfAPerson) {
  Gymnast gymnast("baseline41");
  const MarkerSet& truth = gymnast.marker_set();
  const auto take = gymnast.take(1800, 0.002);

  const auto body = find_body(take, names_of(truth), "gymnast");

  ASSERT_TRUE(body) << body.error().message;
  ASSERT_EQ(body->marker_set.markers.size(), truth.markers.size());
  // Markers of one bone of three markers or more stay together.
  for (const auto& [one, other] : {std::pair{"LThigh", "LKneeOut"}, std::pair{"HeadFront", "HeadTop"}}) {
    EXPECT_EQ(marker_of(body->marker_set, one).bone, marker_of(body->marker_set, other).bone) << one;
  }
  EXPECT_NE(marker_of(body->marker_set, "LThigh").bone, marker_of(body->marker_set, "LShin").bone);
  const kinematics::PoseFit& posed = gymnast.at(0);
  const Eigen::Vector3d knee = joint_place(body->marker_set, "LShin", truth, posed);
  const auto true_bone = static_cast<std::size_t>(marker_of(truth, "LShin").bone);
  EXPECT_LT((knee - posed.world()[true_bone].position).norm(), 0.02);
}

TEST(FunctionalBody, FailsWithoutThreeMarkersThatKeepTheirDistances) {
  const auto take = test_motion::take_of(200, 6, 0.001, [](std::size_t f, std::size_t m) {
    const double rad = 0.05 * static_cast<double>(f * (m + 1));
    return Eigen::Vector3d(std::sin(rad), std::cos(1.3 * rad), 0.2 * static_cast<double>(m));
  });

  const auto body = find_body(take, {"a", "b", "c", "d", "e", "f"}, "nobody");

  ASSERT_FALSE(body);
  EXPECT_EQ(body.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(body.error().message, testing::HasSubstr("record some seconds in which every joint bends"));
}

TEST(FunctionalBody, OfTooManyMarkersIsRefused) {
  const bodyfit::LabelledTake take{200, std::vector<Eigen::Vector3d>(400, Eigen::Vector3d::Zero())};

  EXPECT_FALSE(find_body(take, std::vector<std::string>(200, "m"), "crowd"));
}

TEST(FunctionalBody, NamesBonesAfterTheirMarkers) {
  const auto take = test_motion::take_of(300, 7, 0.001, [](std::size_t f, std::size_t m) {
    static const std::vector<Eigen::Vector3d> kShape_m{{0.05, 0.05, 0.05}, {0.1, 0, 0},   {0, 0.1, 0},  {0, 0, -0.1},
                                                       {0, 0, 0.3},        {0.1, 0, 0.3}, {0, 0.1, 0.3}};
    const double rad = 0.05 * static_cast<double>(f);
    if (m < 4) return kShape_m[m];
    return Eigen::Vector3d(kinematics::from_rotation_vector({0.8 * std::sin(rad), 0.8 * std::cos(1.4 * rad), 0.0}) *
                           kShape_m[m]);
  });

  const auto body = find_body(take, {"WaistL", "WaistR", "WaistF", "WaistB", "LArm", "MArm", "RArm"}, "robot");

  ASSERT_TRUE(body);
  ASSERT_EQ(body->marker_set.skeleton.bones.size(), 2u);
  EXPECT_EQ(body->marker_set.skeleton.bones[0].name, "Waist");
  EXPECT_EQ(body->marker_set.skeleton.bones[1].name, "Arm");
  ASSERT_EQ(body->joints.size(), 1u);
  EXPECT_EQ(body->joints[0].bone, "Arm");
  EXPECT_LT(body->joints[0].rms_m, 0.01);
}

}  // namespace functional_body_test
}  // namespace mocap::functional
