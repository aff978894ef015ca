#include "identify/tpose_finder.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "identify/asymmetry.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace {

using test::person;

struct Cloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> point_of_marker;
};

// A person of other proportions, not quite in T-pose, among points that are no markers.
Cloud stand(const MarkerSet& model, double yaw_rad, int missing, int ghosts, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 1.0);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  MarkerSet other = model;
  const double size = 1.0 + 0.12 * flat(random);
  for (Bone& bone : other.skeleton.bones) bone.rest_offset_m *= size * (1.0 + 0.05 * flat(random));
  for (MarkerOnBone& marker : other.markers) marker.offset_m *= size;
  kinematics::PoseFit body(other, kinematics::PoseFit::Lengths::Fixed);
  std::vector<Pose> locals(body.locals().begin(), body.locals().end());
  for (Pose& local : locals)
    local.rotation =
        kinematics::from_rotation_vector(0.03 * Eigen::Vector3d(normal(random), normal(random), normal(random)));
  locals[0] = {{flat(random), flat(random), 0.96 * size}, kinematics::from_rotation_vector({0.0, 0.0, yaw_rad})};
  body.set_locals(locals);

  Cloud cloud;
  const auto count = model.markers.size();
  for (std::size_t m = 0; m < count; ++m) {
    cloud.point_of_marker.push_back(static_cast<int>(m));
    cloud.points.push_back(body.marker_at(m) + 0.001 * Eigen::Vector3d(normal(random), normal(random), normal(random)));
  }
  for (int i = 0; i < missing; ++i) {
    const auto m = static_cast<std::size_t>(random() % count);
    cloud.points[m] = Eigen::Vector3d(5.0, 5.0 + i, 0.1);
    cloud.point_of_marker[m] = -1;
  }
  for (int i = 0; i < ghosts; ++i) {
    cloud.points.emplace_back(2.0 * flat(random), 2.0 * flat(random), 1.0 + flat(random));
  }
  return cloud;
}

class FindsTPose : public ::testing::TestWithParam<const char*> {};

TEST_P(FindsTPose, AtAnyHeadingAmongGhostsWithMarkersMissing) {
  const MarkerSet model = person(GetParam());
  TPoseFinder finder(model, {}, 128);
  std::mt19937 random(7);
  int found_bodies = 0;
  constexpr int kTrials = 40;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Cloud cloud = stand(model, -3.1 + 0.155 * trial, trial % 3, trial % 6, random);

    const auto& found = finder.find(cloud.points);

    if (!found) continue;
    ++found_bodies;
    for (std::size_t m = 0; m < model.markers.size(); ++m) {
      if (found->point_of_marker[m] >= 0) {
        EXPECT_EQ(found->point_of_marker[m], cloud.point_of_marker[m]) << trial << " " << model.markers[m].name;
      }
    }
    EXPECT_LT(found->rms_m, 0.01);
  }
  // Some stand such that one cannot tell: then it waits for them to move.
  EXPECT_GE(found_bodies, 36);
  RecordProperty("found", found_bodies);
}

INSTANTIATE_TEST_SUITE_P(ShippedSets, FindsTPose, ::testing::Values("openmocap18", "baseline41"),
                         [](const auto& set) { return std::string(set.param); });

TEST(TPoseFinder, FindsNobodyInRandomPoints) {
  TPoseFinder finder(person("openmocap18"), {}, 128);
  std::mt19937 random(8);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 40; ++i) points.emplace_back(flat(random), flat(random), 1.0 + flat(random));

    EXPECT_FALSE(finder.find(points));
  }
}

TEST(TPoseFinder, RefusesTheMirrorImageOfAnAsymmetricSet) {
  const MarkerSet model = person("baseline41");
  TPoseFinder finder(model, {}, 128);
  std::mt19937 random(9);
  Cloud cloud = stand(model, 0.3, 0, 0, random);
  for (Eigen::Vector3d& point : cloud.points) point.y() = -point.y();

  const auto& found = finder.find(cloud.points);

  // At most the reading that has left and right where the mirrored body has them.
  if (found) {
    EXPECT_LT(found->matched, 41);
  }
}

// How many of 40 people are read back to front who wear their limbs' markers on the other face than the set says.
int read_back_to_front(const MarkerSet& set) {
  TPoseFinder finder(set, {}, 128);
  std::mt19937 random(10);
  std::normal_distribution<double> placed_m(0.0, 0.008);
  int turned = 0;
  for (int trial = 0; trial < 40; ++trial) {
    MarkerSet worn = set;
    for (MarkerOnBone& marker : worn.markers) {
      const bool in_the_middle = marker.name == "HeadTop" || marker.name == "BackTop";
      if (!in_the_middle) marker.offset_m.x() = -marker.offset_m.x();
      marker.offset_m += Eigen::Vector3d(placed_m(random), placed_m(random), placed_m(random));
    }
    const Cloud cloud = stand(worn, -3.1 + 0.155 * trial, trial % 2, trial % 6, random);
    const auto& found = finder.find(cloud.points);
    if (!found) continue;
    int wrong = 0;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      wrong += found->point_of_marker[m] >= 0 && found->point_of_marker[m] != cloud.point_of_marker[m] ? 1 : 0;
    }
    turned += 2 * wrong > found->matched ? 1 : 0;
  }
  return turned;
}

TEST(TPoseFinder, ReadsNobodyBackToFrontWhereAsymmetricPairsTellTheSides) {
  const MarkerSet without = test::sparse_person(0.04);
  MarkerSet with = without;
  with.asymmetric = asymmetric_markers(with);
  ASSERT_EQ(with.asymmetric.size(), 3U);

  // Without them, what happens is what they are for.
  EXPECT_GE(read_back_to_front(without), 10);
  EXPECT_EQ(read_back_to_front(with), 0);
}

TEST(TPoseFinder, FindsNobodyAmongTooFewPoints) {
  TPoseFinder finder(person("openmocap18"), {}, 128);

  EXPECT_FALSE(finder.find({}));
  EXPECT_FALSE(finder.find(std::vector<Eigen::Vector3d>(5, Eigen::Vector3d::Zero())));
  EXPECT_FALSE(finder.find(std::vector<Eigen::Vector3d>(40, Eigen::Vector3d::Zero())));
}

}  // namespace
}  // namespace mocap::identify
