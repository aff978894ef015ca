#include "identify/rigid_finder.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

namespace mocap::identify {
namespace rigid_finder_test {

using Eigen::Vector3d;

constexpr double kTolerance_m = 0.004;

// A prop without symmetry.
const std::vector<Vector3d> kProp{
    {0.00, 0.00, 0.00}, {0.20, 0.00, 0.00}, {0.05, 0.13, 0.00}, {0.11, 0.06, 0.10}, {-0.03, 0.02, 0.16}};

MarkerSet prop_of(std::vector<Vector3d> markers) {
  MarkerSet set;
  set.skeleton.bones.emplace_back();
  for (const Vector3d& marker : markers) set.markers.push_back({.name = "m", .offset_m = marker});
  return set;
}

// The markers in another pose.
std::vector<Vector3d> moved(std::vector<Vector3d> markers) {
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(1.9, Vector3d(0.3, -0.8, 0.5).normalized()));
  for (Vector3d& marker : markers) marker = rotation * marker + Vector3d(1.2, -0.7, 0.9);
  return markers;
}

TEST(RigidFinder, FindsEachMarkerOfAMovedPropAmongClutter) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.0005);
  std::uniform_real_distribution<double> flat(-0.5, 0.5);
  RigidFinder finder(prop_of(kProp), kTolerance_m);

  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Vector3d> points = moved(kProp);
    for (Vector3d& point : points) point += Vector3d(noise(random), noise(random), noise(random));
    for (int i = 0; i < 6; ++i)
      points.push_back(Vector3d(1.2, -0.7, 0.9) + Vector3d::NullaryExpr([&] { return flat(random); }));
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::shuffle(order.begin(), order.end(), random);
    std::vector<Vector3d> shuffled;
    for (const std::size_t i : order) shuffled.push_back(points[i]);

    const auto& found = finder.find(shuffled);

    ASSERT_TRUE(found) << trial;
    for (std::size_t m = 0; m < kProp.size(); ++m) {
      EXPECT_EQ(order[static_cast<std::size_t>(found->point_of_marker[m])], m) << trial;
    }
    EXPECT_EQ(found->matched, 5);
    EXPECT_LT(found->rms_m, 0.0015);  // the noise of three axes is 0.9 mm rms
  }
}

TEST(RigidFinder, NeverFitsAMirrorImage) {
  RigidFinder finder(prop_of(kProp), kTolerance_m);
  std::vector<Vector3d> mirrored = kProp;
  for (Vector3d& marker : mirrored) marker.x() = -marker.x();

  EXPECT_FALSE(finder.find(moved(mirrored)));
  EXPECT_TRUE(finder.find(moved(kProp)));
}

TEST(RigidFinder, FindsNothingIfTwoAssignmentsFitEquallyWell) {
  // Half a turn about the axis of symmetry exchanges the second and the third marker.
  RigidFinder symmetric(prop_of({{0.2, 0.0, 0.0}, {0.0, 0.1, 0.0}, {0.0, -0.1, 0.0}}), kTolerance_m);
  RigidFinder asymmetric(prop_of({{0.2, 0.0, 0.0}, {0.0, 0.1, 0.0}, {0.0, -0.05, 0.0}}), kTolerance_m);

  EXPECT_FALSE(symmetric.find(moved({{0.2, 0.0, 0.0}, {0.0, 0.1, 0.0}, {0.0, -0.1, 0.0}})));
  EXPECT_TRUE(asymmetric.find(moved({{0.2, 0.0, 0.0}, {0.0, 0.1, 0.0}, {0.0, -0.05, 0.0}})));
}

TEST(RigidFinder, ToleratesOneMissingMarkerOfFiveButNotOfFour) {
  const std::vector<Vector3d> four(kProp.begin(), kProp.end() - 1);
  RigidFinder finder_of_five(prop_of(kProp), kTolerance_m), finder_of_four(prop_of(four), kTolerance_m);
  const std::vector<Vector3d> three(four.begin(), four.end() - 1);

  const auto& five_minus_one = finder_of_five.find(moved(four));

  ASSERT_TRUE(five_minus_one);
  EXPECT_EQ(five_minus_one->matched, 4);
  EXPECT_EQ(five_minus_one->point_of_marker[4], -1);
  EXPECT_FALSE(finder_of_five.find(moved(three)));
  EXPECT_FALSE(finder_of_four.find(moved(three)));
  EXPECT_FALSE(finder_of_four.find({}));
}

TEST(RigidFinder, RejectsAPropThatIsBentBeyondTheTolerance) {
  RigidFinder finder(prop_of(kProp), kTolerance_m);
  std::vector<Vector3d> bent = kProp;
  bent[3].z() += 5.0 * kTolerance_m;
  bent[4].x() += 5.0 * kTolerance_m;

  EXPECT_FALSE(finder.find(moved(bent)));
}

// Three markers on a line propose no pose: the rotation about the line is unknown.
TEST(RigidFinder, FindsAPropWhoseFirstThreeMarkersLieOnALine) {
  for (const double off_m : {0.0, 0.002}) {  // from the line
    const std::vector<Vector3d> prop{
        {0.00, 0.00, 0.00}, {0.10, off_m, 0.00}, {0.25, 0.00, 0.00}, {0.05, 0.13, 0.00}, {0.11, 0.06, 0.10}};
    RigidFinder finder(prop_of(prop), kTolerance_m);
    std::vector<Vector3d> points = moved(prop);
    for (std::size_t i = 0; i < points.size(); ++i) points[i].z() += i % 2 == 0 ? 0.0005 : -0.0005;

    const auto& found = finder.find(points);

    ASSERT_TRUE(found) << off_m;
    for (std::size_t m = 0; m < prop.size(); ++m) EXPECT_EQ(found->point_of_marker[m], static_cast<int>(m)) << off_m;
  }
}

}  // namespace rigid_finder_test
}  // namespace mocap::identify
