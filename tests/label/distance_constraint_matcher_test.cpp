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
namespace distance_constraint_matcher_test {

constexpr double kUnassigned = 12.0;

// The markers of some bones of a body in a random pose, as candidates in random order.
struct Limb {
  MarkerSet set = test::person("baseline41");
  identify::DistanceConstraints constraints{set};
  kinematics::PoseFit truth{set, kinematics::PoseFit::Lengths::Fixed};
  DistanceConstraintMatcher matcher;
  std::vector<std::size_t> candidate_of;  // by label

  explicit Limb(const std::vector<std::string>& bones, unsigned seed) {
    std::mt19937 random(seed);
    truth.set_locals(test::random_pose(set, 0.5, random));
    std::vector<std::size_t> markers;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      const std::string& bone = set.skeleton.bones[static_cast<std::size_t>(set.markers[m].bone)].name;
      if (std::find(bones.begin(), bones.end(), bone) != bones.end()) markers.push_back(m);
    }
    for (const std::size_t m : markers) EXPECT_TRUE(matcher.add_label(m));
    std::vector<std::size_t> order(markers.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    candidate_of.resize(markers.size());
    for (std::size_t p = 0; p < order.size(); ++p) {
      EXPECT_TRUE(matcher.add_candidate(truth.marker_at(markers[order[p]])));
      candidate_of[order[p]] = p;
    }
  }

  void allow_all() {
    for (std::size_t n = 0; n < matcher.label_count(); ++n) {
      for (std::size_t p = 0; p < matcher.candidate_count(); ++p) matcher.allow(n, p, 0.0);
    }
  }
  bool is_true_assignment(const DistanceConstraintMatcher::AssignmentHypothesis& hypothesis) const {
    for (std::size_t n = 0; n < candidate_of.size(); ++n) {
      if (hypothesis.candidate_of[n] != static_cast<int>(candidate_of[n])) return false;
    }
    return true;
  }
};

TEST(DistanceConstraintMatcher, FindsTheTrueAssignmentOfALeg) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Limb limb({"LeftUpLeg", "LeftLowLeg", "LeftFoot"}, seed);
    limb.allow_all();

    const auto hypotheses = limb.matcher.solve(limb.constraints, kUnassigned);

    ASSERT_FALSE(hypotheses.empty());
    EXPECT_TRUE(std::any_of(hypotheses.begin(), hypotheses.end(), [&](const auto& one) {
      return limb.is_true_assignment(one);
    })) << seed;
    EXPECT_TRUE(std::is_sorted(hypotheses.begin(), hypotheses.end(),
                               [](const auto& a, const auto& b) { return a.cost < b.cost; }));
  }
}

TEST(DistanceConstraintMatcher, LeavesALabelUnassignedRatherThanViolateADistance) {
  Limb limb({"LeftFoot"}, 3);
  limb.allow_all();
  DistanceConstraintMatcher& matcher = limb.matcher;
  const std::size_t gone = 0;
  std::vector<Eigen::Vector3d> candidates;
  for (std::size_t p = 0; p < matcher.candidate_count(); ++p) candidates.push_back(matcher.candidate(p));
  candidates[limb.candidate_of[gone]] += Eigen::Vector3d(0.3, 0.0, 0.0);
  std::vector<std::size_t> markers;
  for (std::size_t n = 0; n < matcher.label_count(); ++n) markers.push_back(matcher.marker(n));
  matcher.clear();
  for (const std::size_t m : markers) ASSERT_TRUE(matcher.add_label(m));
  for (const auto& candidate : candidates) ASSERT_TRUE(matcher.add_candidate(candidate));
  limb.allow_all();

  const auto hypotheses = matcher.solve(limb.constraints, kUnassigned);

  ASSERT_FALSE(hypotheses.empty());
  EXPECT_EQ(hypotheses[0].candidate_of[gone], DistanceConstraintMatcher::kUnassigned);
  EXPECT_NEAR(hypotheses[0].cost, kUnassigned, 1e-6);
}

TEST(DistanceConstraintMatcher, UsesNoCandidateTwice) {
  Limb limb({"RightUpArm", "RightLowArm", "RightHand"}, 5);
  limb.allow_all();

  for (const auto& hypothesis : limb.matcher.solve(limb.constraints, kUnassigned)) {
    std::vector<int> uses(limb.matcher.candidate_count(), 0);
    for (std::size_t n = 0; n < limb.matcher.label_count(); ++n) {
      if (hypothesis.candidate_of[n] >= 0) ++uses[static_cast<std::size_t>(hypothesis.candidate_of[n])];
    }
    for (const int count : uses) EXPECT_LE(count, 1);
  }
}

TEST(DistanceConstraintMatcher, ListsAlternativesToACandidate) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Limb limb({"LeftLowArm", "LeftHand"}, seed);
    limb.allow_all();
    DistanceConstraintMatcher::AssignmentHypothesis lone;
    lone.candidate_of.fill(DistanceConstraintMatcher::kUnassigned);
    lone.candidate_of[1] = static_cast<std::int8_t>(limb.candidate_of[1]);

    const auto alternatives = limb.matcher.solve_excluding(limb.constraints, 2.0 * kUnassigned, 1, lone, 3);

    ASSERT_EQ(alternatives.size(), 3U) << seed;
    for (const auto& other : alternatives) EXPECT_NE(other.candidate_of[1], lone.candidate_of[1]) << seed;
    // The search for alternatives does not change later searches.
    const auto hypotheses = limb.matcher.solve(limb.constraints, kUnassigned);
    EXPECT_TRUE(std::any_of(hypotheses.begin(), hypotheses.end(),
                            [&](const auto& one) { return limb.is_true_assignment(one); }));
  }
}

// Brute force: all assignments of a limb, one after the other.
struct EveryAssignment {
  const Limb& limb;
  const std::vector<std::vector<double>>& costs;                    // by label and candidate
  std::size_t excluded_label;                                       // label whose candidate is excluded
  const DistanceConstraintMatcher::AssignmentHypothesis* excluded;  // null: all assignments
  std::vector<DistanceConstraintMatcher::AssignmentHypothesis> found;

  bool is_allowed(std::size_t n, int candidate) const {
    if (excluded == nullptr || candidate == DistanceConstraintMatcher::kUnassigned) return true;
    if (n == excluded_label) return false;
    return excluded->candidate_of[n] == DistanceConstraintMatcher::kUnassigned ||
           candidate == excluded->candidate_of[n];
  }
  double cost_of(const DistanceConstraintMatcher::AssignmentHypothesis& hypothesis) const {
    double sum = 0.0;
    for (std::size_t n = 0; n < limb.matcher.label_count(); ++n) {
      if (hypothesis.candidate_of[n] == DistanceConstraintMatcher::kUnassigned) {
        sum += kUnassigned;
        continue;
      }
      const auto p = static_cast<std::size_t>(hypothesis.candidate_of[n]);
      sum += costs[n][p];
      for (const identify::InterMarkerDistance& constraint : limb.constraints.of(limb.matcher.marker(n))) {
        for (std::size_t o = 0; o < n; ++o) {
          if (limb.matcher.marker(o) != static_cast<std::size_t>(constraint.other) || hypothesis.candidate_of[o] < 0)
            continue;
          const Eigen::Vector3d& at = limb.matcher.candidate(static_cast<std::size_t>(hypothesis.candidate_of[o]));
          sum += DistanceConstraintMatcher::cost_of(constraint, (limb.matcher.candidate(p) - at).norm());
        }
      }
    }
    return sum;
  }
  void from(std::size_t n, DistanceConstraintMatcher::AssignmentHypothesis& hypothesis) {
    if (n == limb.matcher.label_count()) {
      hypothesis.cost = cost_of(hypothesis);
      found.push_back(hypothesis);
      return;
    }
    for (int candidate = DistanceConstraintMatcher::kUnassigned;
         candidate < static_cast<int>(limb.matcher.candidate_count()); ++candidate) {
      const std::int8_t* end = hypothesis.candidate_of.data() + n;
      const bool taken =
          candidate >= 0 && std::find(std::as_const(hypothesis).candidate_of.data(), end, candidate) != end;
      if (taken || !is_allowed(n, candidate)) continue;
      hypothesis.candidate_of[n] = static_cast<std::int8_t>(candidate);
      from(n + 1, hypothesis);
    }
  }
  std::vector<DistanceConstraintMatcher::AssignmentHypothesis> cheapest(std::size_t most) {
    DistanceConstraintMatcher::AssignmentHypothesis hypothesis;
    hypothesis.candidate_of.fill(DistanceConstraintMatcher::kUnassigned);
    from(0, hypothesis);
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.cost < b.cost; });
    found.resize(std::min(most, found.size()));
    return found;
  }
};

void expect_same(std::span<const DistanceConstraintMatcher::AssignmentHypothesis> hypotheses,
                 const std::vector<DistanceConstraintMatcher::AssignmentHypothesis>& oracle, std::size_t label_count) {
  ASSERT_EQ(hypotheses.size(), oracle.size());
  for (std::size_t i = 0; i < oracle.size(); ++i) {
    EXPECT_NEAR(hypotheses[i].cost, oracle[i].cost, 1e-9) << i;
    for (std::size_t n = 0; n < label_count; ++n)
      EXPECT_EQ(hypotheses[i].candidate_of[n], oracle[i].candidate_of[n]) << i << ' ' << n;
  }
}

// Each marker has a second candidate within 20 mm, and each pair of label and candidate has a random cost.
TEST(DistanceConstraintMatcher, ListsTheSameAlternativesAsBruteForce) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    Limb limb({"LeftLowArm", "LeftHand"}, seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    const std::size_t label_count = std::min(limb.matcher.label_count(), DistanceConstraintMatcher::kMaxLimbLabels);
    for (std::size_t p = 0; p < label_count; ++p)
      ASSERT_TRUE(limb.matcher.add_candidate(limb.matcher.candidate(p) +
                                             0.02 * Eigen::Vector3d(any(random), any(random), 0.0)));
    std::vector<std::vector<double>> costs(label_count, std::vector<double>(limb.matcher.candidate_count()));
    for (std::size_t n = 0; n < label_count; ++n) {
      for (std::size_t p = 0; p < limb.matcher.candidate_count(); ++p) {
        costs[n][p] = 2.0 + 2.0 * any(random);
        limb.matcher.allow(n, p, costs[n][p]);
      }
    }
    DistanceConstraintMatcher::AssignmentHypothesis excluded;
    for (std::size_t n = 0; n < label_count; ++n)
      excluded.candidate_of[n] = static_cast<std::int8_t>(limb.candidate_of[n]);
    excluded.candidate_of[seed % label_count] = DistanceConstraintMatcher::kUnassigned;
    const std::size_t excluded_label = (seed + 1) % label_count;

    const std::size_t most = 1 + seed % 4;
    const auto alternatives =
        limb.matcher.solve_excluding(limb.constraints, kUnassigned, excluded_label, excluded, most);

    expect_same(alternatives, EveryAssignment{limb, costs, excluded_label, &excluded, {}}.cheapest(most), label_count);
    // The search for alternatives does not change later searches.
    expect_same(
        limb.matcher.solve(limb.constraints, kUnassigned),
        EveryAssignment{limb, costs, excluded_label, nullptr, {}}.cheapest(DistanceConstraintMatcher::kMaxAssignments),
        label_count);
  }
}

TEST(DistanceConstraintMatcher, KeepsTheOtherLabelsInAlternatives) {
  Limb limb({"LeftLowArm", "LeftHand"}, 4);
  limb.allow_all();
  DistanceConstraintMatcher::AssignmentHypothesis truth;
  truth.candidate_of.fill(DistanceConstraintMatcher::kUnassigned);
  const std::size_t label_count = std::min(limb.candidate_of.size(), DistanceConstraintMatcher::kMaxLimbLabels);
  for (std::size_t n = 0; n + 1 < label_count; ++n)
    truth.candidate_of[n] = static_cast<std::int8_t>(limb.candidate_of[n]);

  const auto alternatives = limb.matcher.solve_excluding(limb.constraints, kUnassigned, 0, truth, 3);

  ASSERT_FALSE(alternatives.empty());
  for (const auto& other : alternatives) {
    EXPECT_NE(other.candidate_of[0], truth.candidate_of[0]);
    for (std::size_t n = 1; n + 1 < label_count; ++n)
      EXPECT_TRUE(other.candidate_of[n] == truth.candidate_of[n] ||
                  other.candidate_of[n] == DistanceConstraintMatcher::kUnassigned);
  }
}

}  // namespace distance_constraint_matcher_test
}  // namespace mocap::label
