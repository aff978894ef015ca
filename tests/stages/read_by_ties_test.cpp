#include "stages/read_by_ties.h"

#include <gtest/gtest.h>

#include <random>

#include "body/pose_fit.h"
#include "body/test_body.h"

namespace mocap::stages {
namespace {

constexpr double kNowhere = 12.0;

// The markers of some bones of a body in some pose, as places in a mixed order; every name may be anywhere.
struct Limb {
  MarkerSet set = test::person("baseline41");
  body::MarkerTies ties{set};
  body::PoseFit truth{set, body::PoseFit::Lengths::Fixed};
  TieReader reader;
  std::vector<std::size_t> place_of;  // by name

  explicit Limb(const std::vector<std::string>& bones, unsigned seed) {
    std::mt19937 random(seed);
    truth.set_locals(test::random_pose(set, 0.5, random));
    std::vector<std::size_t> markers;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      const std::string& bone = set.skeleton.bones[static_cast<std::size_t>(set.markers[m].bone)].name;
      if (std::find(bones.begin(), bones.end(), bone) != bones.end()) markers.push_back(m);
    }
    for (const std::size_t m : markers) EXPECT_TRUE(reader.add_name(m));
    std::vector<std::size_t> order(markers.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    place_of.resize(markers.size());
    for (std::size_t p = 0; p < order.size(); ++p) {
      EXPECT_TRUE(reader.add_place(truth.marker_at(markers[order[p]])));
      place_of[order[p]] = p;
    }
  }

  void allow_all() {
    for (std::size_t n = 0; n < reader.names(); ++n) {
      for (std::size_t p = 0; p < reader.places(); ++p) reader.allow(n, p, 0.0);
    }
  }
  bool is_truth(const TieReader::Reading& reading) const {
    for (std::size_t n = 0; n < place_of.size(); ++n) {
      if (reading.place_of[n] != static_cast<int>(place_of[n])) return false;
    }
    return true;
  }
};

TEST(TieReader, HasTheTruthAmongItsReadingsOfALeg) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Limb limb({"LeftUpLeg", "LeftLowLeg", "LeftFoot"}, seed);
    limb.allow_all();

    const auto readings = limb.reader.read(limb.ties, kNowhere);

    ASSERT_FALSE(readings.empty());
    EXPECT_TRUE(std::any_of(readings.begin(), readings.end(), [&](const auto& one) { return limb.is_truth(one); }))
        << seed;
    EXPECT_TRUE(
        std::is_sorted(readings.begin(), readings.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; }));
  }
}

TEST(TieReader, LeavesANameNowhereRatherThanAtAPlaceThatBreaksABone) {
  Limb limb({"LeftFoot"}, 3);
  limb.allow_all();
  TieReader& reader = limb.reader;
  const std::size_t gone = 0;
  std::vector<Eigen::Vector3d> places;
  for (std::size_t p = 0; p < reader.places(); ++p) places.push_back(reader.place(p));
  places[limb.place_of[gone]] += Eigen::Vector3d(0.3, 0.0, 0.0);
  std::vector<std::size_t> markers;
  for (std::size_t n = 0; n < reader.names(); ++n) markers.push_back(reader.marker(n));
  reader.clear();
  for (const std::size_t m : markers) ASSERT_TRUE(reader.add_name(m));
  for (const auto& place : places) ASSERT_TRUE(reader.add_place(place));
  limb.allow_all();

  const auto readings = reader.read(limb.ties, kNowhere);

  ASSERT_FALSE(readings.empty());
  EXPECT_EQ(readings[0].place_of[gone], TieReader::kNowhere);
  EXPECT_NEAR(readings[0].cost, kNowhere, 1e-6);
}

TEST(TieReader, GivesNoPlaceTwice) {
  Limb limb({"RightUpArm", "RightLowArm", "RightHand"}, 5);
  limb.allow_all();

  for (const auto& reading : limb.reader.read(limb.ties, kNowhere)) {
    std::vector<int> uses(limb.reader.places(), 0);
    for (std::size_t n = 0; n < limb.reader.names(); ++n) {
      if (reading.place_of[n] >= 0) ++uses[static_cast<std::size_t>(reading.place_of[n])];
    }
    for (const int count : uses) EXPECT_LE(count, 1);
  }
}

TEST(TieReader, SaysWhoElseMayBeWhereANameIs) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Limb limb({"LeftLowArm", "LeftHand"}, seed);
    limb.allow_all();
    TieReader::Reading lone;
    lone.place_of.fill(TieReader::kNowhere);
    lone.place_of[1] = static_cast<std::int8_t>(limb.place_of[1]);

    const auto others = limb.reader.read_otherwise(limb.ties, 2.0 * kNowhere, 1, lone, 3);

    ASSERT_EQ(others.size(), 3U) << seed;
    for (const auto& other : others) EXPECT_NE(other.place_of[1], lone.place_of[1]) << seed;
    // The question leaves nothing behind.
    const auto readings = limb.reader.read(limb.ties, kNowhere);
    EXPECT_TRUE(std::any_of(readings.begin(), readings.end(), [&](const auto& one) { return limb.is_truth(one); }));
  }
}

TEST(TieReader, MovesNoNameThatIsSomewhereToAskWhoElseIsThere) {
  Limb limb({"LeftLowArm", "LeftHand"}, 4);
  limb.allow_all();
  TieReader::Reading truth;
  truth.place_of.fill(TieReader::kNowhere);
  const std::size_t names = std::min(limb.place_of.size(), TieReader::kMostNames);
  for (std::size_t n = 0; n + 1 < names; ++n) truth.place_of[n] = static_cast<std::int8_t>(limb.place_of[n]);

  const auto others = limb.reader.read_otherwise(limb.ties, kNowhere, 0, truth, 3);

  ASSERT_FALSE(others.empty());
  for (const auto& other : others) {
    EXPECT_NE(other.place_of[0], truth.place_of[0]);
    for (std::size_t n = 1; n + 1 < names; ++n)
      EXPECT_TRUE(other.place_of[n] == truth.place_of[n] || other.place_of[n] == TieReader::kNowhere);
  }
}

}  // namespace
}  // namespace mocap::stages
