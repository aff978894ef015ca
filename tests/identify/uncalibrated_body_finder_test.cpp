#include "identify/uncalibrated_body_finder.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <vector>

#include "identify/labelled_cloud.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace uncalibrated_body_finder_test {

using test::Cloud;
using test::person;
using test::random_cloud;

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

// Searches in all sizes, until a body is found.
const std::optional<FoundUncalibratedBody>& find(UncalibratedBodyFinder& finder, const Cloud& cloud) {
  for (int size = 0; size < 5; ++size) {
    finder.begin(cloud.points);
    while (finder.searching()) (void)finder.advance(100000);
    if (finder.found()) break;
  }
  return finder.found();
}

TEST(UncalibratedBodyFinder, FindsPeopleOfOtherDimensionsInRandomPoses) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> size(0.87, 1.13);
  for (const char* name : {"openmocap18", "pluginGait39", "baseline41"}) {
    const MarkerSet set = person(name);
    UncalibratedBodyFinder finder(set);
    int found_bodies = 0, right = 0, wrong = 0;
    for (int trial = 0; trial < 12; ++trial) {
      const MarkerSet body = wearer_of(set, size(random), 0.006, random);
      const Cloud cloud = random_cloud(body, trial % 4, trial % 3, random, 0.8);
      const auto& found = find(finder, cloud);
      if (!found) continue;
      ++found_bodies;
      right += test::count_labels(found->pose, cloud).right;
      wrong += test::count_labels(found->pose, cloud).wrong;
    }

    EXPECT_GE(found_bodies, 9) << name;
    EXPECT_EQ(wrong, 0) << name;
    EXPECT_GE(2 * right, found_bodies * static_cast<int>(set.markers.size())) << name;
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
