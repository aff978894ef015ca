#include "label/distance_constraint_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kinematics/pose_fit.h"
#include "support/test_body.h"

namespace mocap::label {
namespace {

constexpr double kNowhere = 12.0;

// The markers of some bones of a body in some pose, as places in a mixed order; every name may be anywhere.
struct Limb {
  MarkerSet set = test::person("baseline41");
  identify::MarkerTies ties{set};
  kinematics::PoseFit truth{set, kinematics::PoseFit::Lengths::Fixed};
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

// All readings of a limb whose names may be anywhere, tried one after the other.
struct EveryReading {
  const Limb& limb;
  const std::vector<std::vector<double>>& costs;  // by name and place
  std::size_t name;                               // is nowhere, where `but` is asked for
  const TieReader::Reading* but;                  // null: of every name any place is asked for
  std::vector<TieReader::Reading> found;

  bool open(std::size_t n, int place) const {
    if (but == nullptr || place == TieReader::kNowhere) return true;
    if (n == name) return false;
    return but->place_of[n] == TieReader::kNowhere || place == but->place_of[n];
  }
  double cost_of(const TieReader::Reading& reading) const {
    double sum = 0.0;
    for (std::size_t n = 0; n < limb.reader.names(); ++n) {
      if (reading.place_of[n] == TieReader::kNowhere) {
        sum += kNowhere;
        continue;
      }
      const auto p = static_cast<std::size_t>(reading.place_of[n]);
      sum += costs[n][p];
      for (const identify::Tie& tie : limb.ties.of(limb.reader.marker(n))) {
        for (std::size_t o = 0; o < n; ++o) {
          if (limb.reader.marker(o) != static_cast<std::size_t>(tie.other) || reading.place_of[o] < 0) continue;
          const Eigen::Vector3d& at = limb.reader.place(static_cast<std::size_t>(reading.place_of[o]));
          sum += TieReader::cost_of(tie, (limb.reader.place(p) - at).norm());
        }
      }
    }
    return sum;
  }
  void from(std::size_t n, TieReader::Reading& reading) {
    if (n == limb.reader.names()) {
      reading.cost = cost_of(reading);
      found.push_back(reading);
      return;
    }
    for (int place = TieReader::kNowhere; place < static_cast<int>(limb.reader.places()); ++place) {
      const std::int8_t* end = reading.place_of.data() + n;
      const bool taken = place >= 0 && std::find(std::as_const(reading).place_of.data(), end, place) != end;
      if (taken || !open(n, place)) continue;
      reading.place_of[n] = static_cast<std::int8_t>(place);
      from(n + 1, reading);
    }
  }
  std::vector<TieReader::Reading> cheapest(std::size_t most) {
    TieReader::Reading reading;
    reading.place_of.fill(TieReader::kNowhere);
    from(0, reading);
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
    found.resize(std::min(most, found.size()));
    return found;
  }
};

void expect_same(std::span<const TieReader::Reading> readings, const std::vector<TieReader::Reading>& oracle,
                 std::size_t names) {
  ASSERT_EQ(readings.size(), oracle.size());
  for (std::size_t i = 0; i < oracle.size(); ++i) {
    EXPECT_NEAR(readings[i].cost, oracle[i].cost, 1e-9) << i;
    for (std::size_t n = 0; n < names; ++n) EXPECT_EQ(readings[i].place_of[n], oracle[i].place_of[n]) << i << ' ' << n;
  }
}

// Beside each marker stands a light that may be it, and each name likes each place more or less.
TEST(TieReader, SaysAsCheaplyAsCanBeWhoElseMayBeWhereANameIs) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Limb limb({"LeftLowArm", "LeftHand"}, seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const std::size_t names = std::min(limb.reader.names(), TieReader::kMostNames);
    for (std::size_t p = 0; p < names; ++p)
      ASSERT_TRUE(limb.reader.add_place(limb.reader.place(p) + 0.02 * Eigen::Vector3d(any(random), any(random), 0.0)));
    std::vector<std::vector<double>> costs(names, std::vector<double>(limb.reader.places()));
    for (std::size_t n = 0; n < names; ++n) {
      for (std::size_t p = 0; p < limb.reader.places(); ++p) {
        costs[n][p] = 2.0 + 2.0 * any(random);
        limb.reader.allow(n, p, costs[n][p]);
      }
    }
    TieReader::Reading but;
    for (std::size_t n = 0; n < names; ++n) but.place_of[n] = static_cast<std::int8_t>(limb.place_of[n]);
    but.place_of[seed % names] = TieReader::kNowhere;
    const std::size_t name = (seed + 1) % names;

    const std::size_t most = 1 + seed % 4;
    const auto others = limb.reader.read_otherwise(limb.ties, kNowhere, name, but, most);

    expect_same(others, EveryReading{limb, costs, name, &but, {}}.cheapest(most), names);
    // The question leaves nothing behind.
    expect_same(limb.reader.read(limb.ties, kNowhere),
                EveryReading{limb, costs, name, nullptr, {}}.cheapest(TieReader::kMostReadings), names);
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
}  // namespace mocap::label
