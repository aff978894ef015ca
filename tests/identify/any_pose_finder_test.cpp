#include "identify/any_pose_finder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "support/test_body.h"

namespace mocap::identify {
namespace {

using test::person;

struct Cloud {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> marker_of_point;  // -1: nobody's
};

// A person in some pose, some markers hidden, some points about that are no markers, in no order.
Cloud stand(const MarkerSet& set, int hidden, int ghosts, std::mt19937& random) {
  std::normal_distribution<double> normal(0.0, 0.0005);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.set_locals(test::random_pose(set, 1.0, random));
  std::vector<int> markers(set.markers.size());
  for (std::size_t m = 0; m < markers.size(); ++m) markers[m] = static_cast<int>(m);
  std::shuffle(markers.begin(), markers.end(), random);
  markers.resize(markers.size() - static_cast<std::size_t>(hidden));
  for (int i = 0; i < ghosts; ++i) markers.push_back(-1);
  std::shuffle(markers.begin(), markers.end(), random);
  Cloud cloud;
  for (const int m : markers) {
    Eigen::Vector3d at =
        m < 0 ? Eigen::Vector3d(body.world()[0].position + Eigen::Vector3d(flat(random), flat(random), flat(random)))
              : body.marker_at(static_cast<std::size_t>(m));
    at += Eigen::Vector3d(normal(random), normal(random), normal(random));
    cloud.points.push_back(at);
    cloud.marker_of_point.push_back(m);
  }
  return cloud;
}

struct Names {
  int right = 0;
  int wrong = 0;
};

Names judge(const FoundPose& found, const Cloud& cloud) {
  Names names;
  for (std::size_t m = 0; m < found.point_of_marker.size(); ++m) {
    const int p = found.point_of_marker[m];
    if (p < 0) continue;
    const bool right = cloud.marker_of_point[static_cast<std::size_t>(p)] == static_cast<int>(m);
    ++(right ? names.right : names.wrong);
  }
  return names;
}

// Another body than the file's, as no file knows it: sides that differ by a per cent or so.
MarkerSet some_body(const std::string& name, std::mt19937& random) {
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  MarkerSet set = person(name);
  const double size = 1.0 + 0.1 * flat(random);
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= size * (1.0 + 0.02 * flat(random));
  for (MarkerOnBone& marker : set.markers) marker.offset_m *= size;
  return set;
}

class FindsAnyPose : public ::testing::TestWithParam<const char*> {};

TEST_P(FindsAnyPose, AmongGhostsWithMarkersMissing) {
  std::mt19937 random(11);
  int found_bodies = 0, right = 0, wrong = 0;
  constexpr int kTrials = 12;
  for (int trial = 0; trial < kTrials; ++trial) {
    const MarkerSet set = some_body(GetParam(), random);
    AnyPoseFinder finder(set, {});
    const Cloud cloud = stand(set, trial % 3, 2 * (trial % 3), random);

    const auto& found = finder.find(cloud.points);

    if (!found) continue;
    ++found_bodies;
    right += judge(*found, cloud).right;
    wrong += judge(*found, cloud).wrong;
    EXPECT_LT(found->rms_m, 0.003) << trial;
  }
  // Some stand such that one cannot tell: then it waits for them to move.
  EXPECT_GE(found_bodies, 11);
  // Of 180 bodies in baseline41, 60 for each of three seeds, one has two wrong names, the head's: it is this seed's.
  EXPECT_LE(wrong, 2);
  // One marker a joint leaves some open as long as any ghost is about.
  EXPECT_GE(right, found_bodies * static_cast<int>(person(GetParam()).markers.size()) * 11 / 20);
}

INSTANTIATE_TEST_SUITE_P(ShippedSets, FindsAnyPose, ::testing::Values("openmocap18", "baseline41", "pluginGait39"),
                         [](const auto& set) { return std::string(set.param); });

TEST(AnyPoseFinder, FindsNobodyInRandomPoints) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  for (const char* name : {"openmocap18", "baseline41"}) {
    AnyPoseFinder finder(person(name), {});
    for (int trial = 0; trial < 5; ++trial) {
      std::vector<Eigen::Vector3d> points;
      for (int i = 0; i < 45; ++i) points.emplace_back(flat(random), flat(random), 1.0 + flat(random));

      EXPECT_FALSE(finder.find(points)) << name;
    }
  }
}

TEST(AnyPoseFinder, FindsNobodyAmongTooFewPoints) {
  AnyPoseFinder finder(person("openmocap18"), {});

  EXPECT_FALSE(finder.find({}));
  EXPECT_FALSE(finder.find(std::vector<Eigen::Vector3d>(5, Eigen::Vector3d::Zero())));
  EXPECT_FALSE(finder.find(std::vector<Eigen::Vector3d>(40, Eigen::Vector3d::Zero())));
}

TEST(AnyPoseFinder, LeavesOutWhatTellsLeftFromRightOfAMirrorImage) {
  std::mt19937 random(13);
  const MarkerSet set = person("baseline41");
  AnyPoseFinder finder(set, {});
  for (int trial = 0; trial < 3; ++trial) {
    Cloud cloud = stand(set, 0, 0, random);
    for (Eigen::Vector3d& point : cloud.points) point.y() = -point.y();

    const auto& found = finder.find(cloud.points);

    // At most the reading that has left and right where the mirrored body has them, without the markers that tell them
    // apart.
    if (found) {
      EXPECT_LE(found->explained, 35);
    }
  }
}

TEST(AnyPoseFinder, FindsTheSameWhenTheWorkIsSpreadOverCalls) {
  std::mt19937 random(14);
  const MarkerSet set = person("baseline41");
  AnyPoseFinder at_once(set, {}), in_turns(set, {});
  const Cloud cloud = stand(set, 2, 4, random);

  const auto& found = at_once.find(cloud.points);
  in_turns.begin(cloud.points);
  int calls = 1;
  while (!in_turns.advance(200)) ++calls;

  ASSERT_TRUE(found && in_turns.found());
  EXPECT_TRUE(std::equal(found->point_of_marker.begin(), found->point_of_marker.end(),
                         in_turns.found()->point_of_marker.begin()));
  EXPECT_GT(calls, 3);
}

TEST(AnyPoseFinder, FindsTheBodyThatItWasFittedTo) {
  std::mt19937 random(15);
  const MarkerSet file = person("baseline41"), body = some_body("baseline41", random);
  AnyPoseFinder finder(file, {});
  std::vector<Eigen::Vector3d> rest_offsets, marker_offsets;
  for (const Bone& bone : body.skeleton.bones) rest_offsets.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : body.markers) marker_offsets.push_back(marker.offset_m);

  finder.refit(rest_offsets, marker_offsets);
  const Cloud cloud = stand(body, 0, 0, random);
  const auto& found = finder.find(cloud.points);

  ASSERT_TRUE(found);
  EXPECT_EQ(judge(*found, cloud).wrong, 0);
  EXPECT_LT(found->rms_m, 0.001);
}

TEST(AnyPoseFinder, FindsItsOwnBodyBesideAnotherOfTheSameSet) {
  std::mt19937 random(16);
  const MarkerSet own = some_body("baseline41", random), other = some_body("baseline41", random);
  AnyPoseFinder finder(own, {});
  Cloud cloud = stand(own, 0, 0, random);
  const Cloud beside = stand(other, 0, 0, random);
  for (std::size_t i = 0; i < beside.points.size(); ++i) {
    cloud.points.push_back(beside.points[i] + Eigen::Vector3d(1.2, 0.0, 0.0));
    cloud.marker_of_point.push_back(-1);
  }

  const auto& found = finder.find(cloud.points);

  ASSERT_TRUE(found);
  EXPECT_EQ(judge(*found, cloud).wrong, 0);
}

}  // namespace
}  // namespace mocap::identify
