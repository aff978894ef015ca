#include "base/archive.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <random>
#include <vector>

#include "identify/any_pose_finder.h"
#include "identify/distance_constraints.h"
#include "identify/uncalibrated_body_finder.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace archive_test {

using test::person;

std::vector<std::byte> write(auto& object) {
  std::vector<std::byte> bytes(1'000'000);
  Archive members = Archive::writer(bytes);
  object.archive(members);
  EXPECT_TRUE(members.ok());
  bytes.resize(members.size());
  return bytes;
}

void read(const std::vector<std::byte>& bytes, auto& object) {
  Archive members = Archive::reader(bytes);
  object.archive(members);
  ASSERT_TRUE(members.ok());
  ASSERT_EQ(members.size(), bytes.size());
}

// Replaces the object by a new one that reads its belief.
void replace(auto& object, const auto& make) {
  const std::vector<std::byte> belief = write(*object);
  object = make();
  read(belief, *object);
  ASSERT_EQ(write(*object), belief);
}

struct Offsets {
  std::vector<Eigen::Vector3d> rest_m, marker_m;
};

// The offsets of a body that is larger than the file, with legs of different lengths.
Offsets fitted_offsets(const MarkerSet& set) {
  Offsets offsets;
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b)
    offsets.rest_m.push_back((1.04 + 0.002 * static_cast<double>(b % 5)) * set.skeleton.bones[b].rest_offset_m);
  for (const MarkerOnBone& marker : set.markers) offsets.marker_m.push_back(1.04 * marker.offset_m);
  return offsets;
}

// The markers of a fitted body in a random pose, without one of them, and clutter points.
std::vector<Eigen::Vector3d> random_points(const MarkerSet& set, const Offsets& fitted, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, 0.001);
  std::uniform_real_distribution<double> flat(-1.0, 1.0);
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.refit(fitted.rest_m, fitted.marker_m);
  body.set_locals(test::random_pose(set, 1.0, random));
  std::vector<Eigen::Vector3d> points;
  for (std::size_t m = 1; m < set.markers.size(); ++m)
    points.push_back(body.marker_at(m) + Eigen::Vector3d(noise(random), noise(random), noise(random)));
  for (int i = 0; i < 12; ++i)
    points.push_back(body.world()[0].position + Eigen::Vector3d(flat(random), flat(random), flat(random)));
  return points;
}

TEST(Archive, AnyPoseFinderContinuesASearchInANewObjectAfterEachCall) {
  std::mt19937 random(21);
  for (const char* name : {"openmocap18", "baseline41"}) {
    const MarkerSet set = person(name);
    const Offsets fitted = fitted_offsets(set);
    AnyPoseFinder whole(set, {});
    auto parts = std::make_unique<AnyPoseFinder>(set, FindAnyPoseSettings{});
    whole.refit(fitted.rest_m, fitted.marker_m);
    parts->refit(fitted.rest_m, fitted.marker_m);
    int found_count = 0;
    for (int trial = 0; trial < 4; ++trial) {
      const std::vector<Eigen::Vector3d> points = random_points(set, fitted, random);
      whole.begin(points);
      parts->begin(points);

      for (int calls = 0; whole.searching(); ++calls) {
        (void)whole.advance(300);
        (void)parts->advance(300);
        replace(parts, [&] { return std::make_unique<AnyPoseFinder>(set, FindAnyPoseSettings{}); });
        ASSERT_EQ(parts->searching(), whole.searching()) << name << " " << calls;
        if (whole.searching()) {
          ASSERT_EQ(parts->work(), whole.work()) << name << " " << calls;
        }
      }
      ASSERT_EQ(whole.found().has_value(), parts->found().has_value());
      if (!whole.found()) continue;
      ++found_count;
      FoundPose one = *whole.found(), other = *parts->found();
      EXPECT_EQ(write(one), write(other)) << name << " " << trial;
    }
    EXPECT_GT(found_count, 0) << name;
  }
}

// In each of its stages, and with the next size.
TEST(Archive, UncalibratedBodyFinderContinuesASearchInANewObjectAfterEachCall) {
  std::mt19937 random(23);
  const MarkerSet set = person("openmocap18");
  const std::vector<Eigen::Vector3d> points = random_points(set, fitted_offsets(set), random);
  UncalibratedBodyFinder whole(set);
  auto parts = std::make_unique<UncalibratedBodyFinder>(set);
  int found_count = 0;
  for (int size = 0; size < 2; ++size) {
    whole.begin(points);
    parts->begin(points);
    for (int calls = 0; whole.searching(); ++calls) {
      (void)whole.advance(100);
      (void)parts->advance(100);
      replace(parts, [&] { return std::make_unique<UncalibratedBodyFinder>(set); });
      ASSERT_EQ(parts->searching(), whole.searching()) << calls;
    }
    ASSERT_EQ(whole.found().has_value(), parts->found().has_value());
    if (!whole.found()) continue;
    ++found_count;
    FoundUncalibratedBody one = *whole.found(), other = *parts->found();
    EXPECT_EQ(write(one), write(other));
  }
  EXPECT_GT(found_count, 0);
}

TEST(Archive, DistanceConstraintsAreThoseOfTheFittedBody) {
  MarkerSet set = person("baseline41");
  const Offsets fitted = fitted_offsets(set);
  DistanceConstraints written(set), taken(set);
  for (std::size_t b = 0; b < fitted.rest_m.size(); ++b) set.skeleton.bones[b].rest_offset_m = fitted.rest_m[b];
  for (std::size_t m = 0; m < fitted.marker_m.size(); ++m) set.markers[m].offset_m = fitted.marker_m[m];
  written.refit(set);

  read(write(written), taken);

  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    for (std::size_t i = 0; i < written.of(m).size(); ++i) {
      EXPECT_EQ(taken.of(m)[i].other, written.of(m)[i].other);
      EXPECT_EQ(taken.of(m)[i].min_m, written.of(m)[i].min_m);
      EXPECT_EQ(taken.of(m)[i].max_m, written.of(m)[i].max_m);
    }
  }
}

TEST(Archive, AnyPoseFinderRefusesIndicesOutsideOfItsPoints) {
  std::mt19937 random(22);
  const MarkerSet set = person("openmocap18");
  AnyPoseFinder finder(set, {});
  finder.begin(random_points(set, fitted_offsets(set), random));
  (void)finder.advance(2000);
  const std::vector<std::byte> belief = write(finder);
  std::uniform_int_distribution<std::size_t> place(0, belief.size() - 1);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::byte> damaged = belief;
    damaged[place(random)] ^= std::byte{0x7F};
    AnyPoseFinder other(set, {});
    Archive members = Archive::reader(damaged);
    other.archive(members);
    if (!members.ok()) ++refused;
  }
  EXPECT_GT(refused, 0);
}

}  // namespace archive_test
}  // namespace mocap::identify
