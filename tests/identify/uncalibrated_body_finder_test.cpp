#include "identify/uncalibrated_body_finder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "support/test_body.h"

namespace mocap::identify {
namespace uncalibrated_body_finder_test {

using test::person;

struct Cloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> marker_of_point;  // -1: clutter
};

// A person who wears the markers of the set: of another size, with bones up to 3 % longer or shorter and markers
// `placed_m` from their places (standard deviation, each axis).
MarkerSet wearer_of(MarkerSet set, double size, double placed_m, std::mt19937& random) {
  std::uniform_real_distribution<double> stretch(0.97, 1.03);
  std::normal_distribution<double> off_m(0.0, placed_m);
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= size * stretch(random);
  for (MarkerOnBone& marker : set.markers)
    marker.offset_m = size * marker.offset_m + Eigen::Vector3d(off_m(random), off_m(random), off_m(random));
  return set;
}

// The markers of a person in a random pose, without `hidden` of them, in random order among `ghosts` clutter points.
Cloud random_cloud(const MarkerSet& body, int hidden, int ghosts, std::mt19937& random) {
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  std::vector<int> markers(body.markers.size());
  std::iota(markers.begin(), markers.end(), 0);
  std::shuffle(markers.begin(), markers.end(), random);
  markers.resize(markers.size() - static_cast<std::size_t>(hidden));
  markers.insert(markers.end(), static_cast<std::size_t>(ghosts), -1);
  std::shuffle(markers.begin(), markers.end(), random);
  kinematics::PoseFit pose(body, kinematics::PoseFit::Lengths::Fixed);
  pose.set_locals(test::random_pose(body, 0.8, random));
  Cloud cloud;
  for (const int m : markers) {
    const Eigen::Vector3d clutter =
        pose.world()[0].position + Eigen::Vector3d(flat(random), flat(random), flat(random));
    cloud.points.push_back(m < 0 ? clutter : pose.marker_at(static_cast<std::size_t>(m)));
    cloud.marker_of_point.push_back(m);
  }
  return cloud;
}

// Searches in all sizes, until a body is found.
const std::optional<FoundUncalibratedBody>& find(UncalibratedBodyFinder& finder, const Cloud& cloud) {
  for (int size = 0; size < 5; ++size) {
    finder.begin(cloud.points);
    while (finder.searching()) (void)finder.advance(100000);
    if (finder.found()) break;
  }
  return finder.found();
}

struct Counts {
  int found = 0, right = 0, wrong = 0;
};

void count(const FoundUncalibratedBody& found, const Cloud& cloud, Counts& into) {
  ++into.found;
  for (std::size_t m = 0; m < found.pose.point_of_marker.size(); ++m) {
    const int p = found.pose.point_of_marker[m];
    if (p < 0) continue;
    ++(cloud.marker_of_point[static_cast<std::size_t>(p)] == static_cast<int>(m) ? into.right : into.wrong);
  }
}

TEST(UncalibratedBodyFinder, FindsPeopleOfOtherDimensionsInRandomPoses) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> size(0.87, 1.13);
  for (const char* name : {"openmocap18", "pluginGait39", "baseline41"}) {
    const MarkerSet set = person(name);
    UncalibratedBodyFinder finder(set);
    Counts counts;
    for (int trial = 0; trial < 4; ++trial) {
      const MarkerSet body = wearer_of(set, size(random), 0.006, random);
      const Cloud cloud = random_cloud(body, trial % 4, trial % 3, random);
      if (const auto& found = find(finder, cloud)) count(*found, cloud, counts);
    }

    EXPECT_GE(counts.found, 3) << name;
    EXPECT_EQ(counts.wrong, 0) << name;
    EXPECT_GE(2 * counts.right, counts.found * static_cast<int>(set.markers.size())) << name;
  }
}

TEST(UncalibratedBodyFinder, FitsTheBoneLengths) {
  std::mt19937 random(6);
  const MarkerSet set = person("baseline41");
  const MarkerSet body = wearer_of(set, 0.94, 0.006, random);
  UncalibratedBodyFinder finder(set);

  const auto& found = find(finder, random_cloud(body, 0, 0, random));

  ASSERT_TRUE(found);
  for (const char* name : {"LeftLowLeg", "RightLowLeg", "LeftLowArm", "RightLowArm"}) {
    const std::size_t bone = test::bone_named(set, name);
    const double length_m = body.skeleton.bones[bone].rest_offset_m.norm();
    EXPECT_NEAR(found->rest_offsets_m[bone].norm(), length_m, 0.02 * length_m) << name;
  }
}

TEST(UncalibratedBodyFinder, TriesAnotherSizeInEachSearch) {
  std::mt19937 random(7);
  const MarkerSet set = person("pluginGait39");
  const Cloud cloud = random_cloud(wearer_of(set, 0.8, 0.003, random), 0, 0, random);
  UncalibratedBodyFinder finder(set);

  finder.begin(cloud.points);
  while (finder.searching()) (void)finder.advance(100000);
  EXPECT_FALSE(finder.found());

  EXPECT_TRUE(find(finder, cloud));
}

TEST(UncalibratedBodyFinder, FindsNoBodyAmongTheMarkersOfAnotherSet) {
  std::mt19937 random(8);
  UncalibratedBodyFinder finder(person("openmocap18"));
  for (const char* worn : {"pluginGait39", "baseline41", "baseline61"}) {
    const MarkerSet model = person(worn);
    for (int trial = 0; trial < 3; ++trial)
      EXPECT_FALSE(find(finder, random_cloud(model, 0, trial, random))) << worn << " " << trial;
  }
}

TEST(UncalibratedBodyFinder, FindsNoBodyInClutter) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  Cloud cloud;
  for (int i = 0; i < 60; ++i) cloud.points.push_back({flat(random), flat(random), flat(random)});
  UncalibratedBodyFinder finder(person("openmocap18"));

  EXPECT_FALSE(find(finder, cloud));
}

}  // namespace uncalibrated_body_finder_test
}  // namespace mocap::identify
