#include "bodyfit/instant_equations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::bodyfit {
namespace instant_equations_test {

using Eigen::Vector3d;

constexpr int kManySteps = 100;

// Markers of a person in a random pose within the joint ranges.
struct Seen {
  explicit Seen(std::uint32_t seed, double noise_m = 0.0) : random(seed), instant(empty_instant(set)) {
    truth.set_locals(test::random_pose(set, 0.5, random));
    std::normal_distribution<double> noise(0.0, noise_m);
    for (std::size_t m = 0; m < set.markers.size(); ++m)
      instant.seen_m[m] = truth.marker_at(m) + Vector3d(noise(random), noise(random), noise(random));
    instant.locals.assign(truth.locals().begin(), truth.locals().end());
  }
  // Rotates each joint by up to 0.2 rad and moves the root by 5 cm.
  void disturb() {
    std::uniform_real_distribution<double> flat(-0.12, 0.12);
    for (Pose& local : instant.locals)
      local.rotation = kinematics::from_rotation_vector({flat(random), flat(random), flat(random)}) * local.rotation;
    instant.locals[0].position.x() += 0.05;
  }
  // The cost of the best pose for these offsets.
  double best_cost(InstantEquations& equations, const BodyOffsets& offsets, const InstantCost& by) const {
    BodyInstant best = instant;
    return equations.optimise_pose(best, offsets, by, kManySteps).cost(by);
  }

  std::mt19937 random;
  MarkerSet set = test::person("baseline41");
  kinematics::PoseFit truth{set, kinematics::PoseFit::Lengths::Fixed};
  BodyInstant instant;
};

// The sum of all parts of the equations of an instant.
struct Sum {
  explicit Sum(const InstantEquations& equations)
      : width(static_cast<std::size_t>(equations.columns().count)), matrix(width * width), gradient(width) {
    for (std::size_t part = 0; part < equations.parts() + 2; ++part) equations.add_to(part, matrix, gradient);
  }
  double diagonal(std::size_t i) const { return matrix[i * width + i]; }

  std::size_t width;
  std::vector<double> matrix, gradient;
};

Vector3d* offset_at(BodyOffsets& offsets, const OffsetColumns& columns, int column) {
  for (std::size_t b = 0; b < columns.bone.size(); ++b) {
    if (columns.bone[b] == column) return &offsets.bones_m[b];
  }
  for (std::size_t m = 0; m < columns.marker.size(); ++m) {
    if (columns.marker[m] == column) return &offsets.markers_m[m];
  }
  return nullptr;
}

TEST(OffsetColumns, AreThreeForEachOffsetAndConsecutiveForALimb) {
  const MarkerSet set = test::person("baseline41");

  const OffsetColumns columns(set);

  const std::size_t offsets = set.skeleton.bones.size() - 1 + set.markers.size();
  EXPECT_EQ(columns.count, static_cast<int>(3 * offsets + 1));
  EXPECT_EQ(columns.size_column, columns.count - 1);
  EXPECT_EQ(columns.bone[0], -1);
  std::vector<int> firsts(columns.bone.begin() + 1, columns.bone.end());
  firsts.insert(firsts.end(), columns.marker.begin(), columns.marker.end());
  std::ranges::sort(firsts);
  for (std::size_t i = 0; i < firsts.size(); ++i) EXPECT_EQ(firsts[i], static_cast<int>(3 * i));
  // The bones and markers below a bone.
  for (std::size_t top = 1; top < set.skeleton.bones.size(); ++top) {
    const auto is_below = [&](int bone) {
      while (bone > static_cast<int>(top)) bone = set.skeleton.bones[static_cast<std::size_t>(bone)].parent;
      return bone == static_cast<int>(top);
    };
    std::vector<int> limb;
    for (std::size_t b = 0; b < columns.bone.size(); ++b) {
      if (is_below(static_cast<int>(b))) limb.push_back(columns.bone[b]);
    }
    for (std::size_t m = 0; m < columns.marker.size(); ++m) {
      if (is_below(set.markers[m].bone)) limb.push_back(columns.marker[m]);
    }
    const auto [least, most] = std::ranges::minmax(limb);
    EXPECT_EQ(most - least, static_cast<int>(3 * (limb.size() - 1))) << set.skeleton.bones[top].name;
  }
}

struct CostsBeside {
  double before, after;
};

/// The costs of the best poses with the offset of one column less and more by `step_m`. `column`: the first of a bone
/// or marker; the axis changes from one to the next.
CostsBeside costs_beside(Seen& seen, InstantEquations& equations, const BodyOffsets& offsets, const InstantCost& by,
                         int column, double step_m) {
  BodyOffsets changed = offsets;
  double& offset = (*offset_at(changed, equations.columns(), column))[column / 3 % 3];
  offset += step_m;
  const double after = seen.best_cost(equations, changed, by);
  offset -= 2.0 * step_m;
  return {seen.best_cost(equations, changed, by), after};
}

TEST(InstantEquations, RecoverThePoseOfMeasuredMarkers) {
  Seen seen(2);
  const BodyOffsets offsets = offsets_of(seen.set);
  const InstantCost by{.rest_sigma_rad = 1e3};
  InstantEquations equations(seen.set);
  seen.disturb();

  const auto pose_cost = equations.optimise_pose(seen.instant, offsets, by, kManySteps);

  for (std::size_t m = 0; m < seen.set.markers.size(); ++m) {
    EXPECT_LT((equations.place(m) - seen.truth.marker_at(m)).norm(), 1e-5) << seen.set.markers[m].name;
  }
  EXPECT_LT(pose_cost.cost(by), 1e-3);
  EXPECT_NEAR(pose_cost.weight, static_cast<double>(seen.set.markers.size()), 0.01);
}

TEST(InstantEquations, ReduceTheCostWithMoreSteps) {
  Seen seen(3, 0.002);
  const BodyOffsets offsets = offsets_of(seen.set);
  const InstantCost by;
  InstantEquations equations(seen.set);
  seen.disturb();

  double before = std::numeric_limits<double>::infinity();
  for (const int steps : {0, 1, 2, 4, 8, 16}) {
    BodyInstant instant = seen.instant;
    const double cost = equations.optimise_pose(instant, offsets, by, steps).cost(by);
    EXPECT_LE(cost, before);
    before = cost;
  }
}

TEST(InstantEquations, GiveAMarkerFarOffLittleWeight) {
  Seen seen(4);
  const BodyOffsets offsets = offsets_of(seen.set);
  InstantEquations equations(seen.set);
  const std::size_t chest = test::marker_named(seen.set, "Chest");
  seen.instant.seen_m[chest] += Vector3d(0.0, 0.0, 0.5);

  equations.optimise_pose(seen.instant, offsets, {.rest_sigma_rad = 1e3}, kManySteps);

  // m: without the robust cost the other markers of the bone move by centimetres
  EXPECT_LT((equations.place(chest) - seen.truth.marker_at(chest)).norm(), 0.003);
}

TEST(InstantEquations, KeepThePoseIfNothingIsMeasured) {
  Seen seen(5);
  std::ranges::fill(seen.instant.seen_m, Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  InstantEquations equations(seen.set);

  const auto pose_cost = equations.optimise_pose(seen.instant, offsets_of(seen.set), {}, kManySteps);

  EXPECT_EQ(pose_cost.data_m2, 0.0);
  EXPECT_EQ(pose_cost.weight, 0.0);
  for (const Pose& local : seen.instant.locals) EXPECT_TRUE(local.rotation.coeffs().allFinite());
  // The prior draws the joints to the rest pose.
  EXPECT_LT(pose_cost.prior, 1e-6);
}

TEST(InstantEquations, HaveTheGradientOfTheCostOfTheBestPose) {
  // The offsets differ from the body by 1 cm, so that residuals and robust weights matter.
  Seen seen(6, 0.002);
  const InstantCost by;
  InstantEquations equations(seen.set);
  BodyOffsets offsets = offsets_of(seen.set);
  std::uniform_real_distribution<double> flat(-0.01, 0.01);
  for (auto* list : {&offsets.bones_m, &offsets.markers_m}) {
    for (Vector3d& offset : *list) offset += Vector3d(flat(seen.random), flat(seen.random), flat(seen.random));
  }
  equations.optimise_pose(seen.instant, offsets, by, kManySteps);

  equations.eliminate(seen.instant, offsets, by);

  const Sum sum(equations);
  double largest = 0.0;
  for (const double g : sum.gradient) largest = std::max(largest, std::abs(g));
  constexpr double kStep_m = 1e-5;
  for (int column = 0; column + 3 < equations.columns().count; column += 3) {
    const int axis = column / 3 % 3;
    const auto [before, after] = costs_beside(seen, equations, offsets, by, column, kStep_m);
    // The equations are those of half the cost. 1/m: 0.1 % of the largest component.
    EXPECT_NEAR(sum.gradient[static_cast<std::size_t>(column + axis)], 0.5 * (after - before) / (2.0 * kStep_m),
                1e-3 * largest)
        << "column " << column;
  }
}

TEST(InstantEquations, HaveTheSameGradientNearTheBestPose) {
  // To first order, the elimination takes the step to the best pose into account.
  Seen seen(9, 0.001);
  const InstantCost by{.outlier_m = 10.0};
  InstantEquations equations(seen.set);
  BodyOffsets offsets = offsets_of(seen.set);
  for (Vector3d& offset : offsets.bones_m) offset *= 1.02;
  equations.optimise_pose(seen.instant, offsets, by, kManySteps);
  equations.eliminate(seen.instant, offsets, by);
  const Sum at_best(equations);
  for (Pose& local : seen.instant.locals)
    local.rotation = kinematics::from_rotation_vector({0.002, -0.002, 0.002}) * local.rotation;

  equations.eliminate(seen.instant, offsets, by);

  const Sum nearby(equations);
  double largest = 0.0;
  for (const double g : at_best.gradient) largest = std::max(largest, std::abs(g));
  for (std::size_t i = 0; i < at_best.gradient.size(); ++i) {
    EXPECT_NEAR(nearby.gradient[i], at_best.gradient[i], 0.02 * largest) << "column " << i;
  }
}

TEST(InstantEquations, HaveTheCurvatureOfTheCostOfTheBestPose) {
  // Without residuals the Gauss-Newton matrix is the second derivative.
  Seen seen(7);
  const InstantCost by{.outlier_m = 10.0, .rest_sigma_rad = 30.0};
  InstantEquations equations(seen.set);
  const BodyOffsets offsets = offsets_of(seen.set);
  equations.optimise_pose(seen.instant, offsets, by, kManySteps);

  equations.eliminate(seen.instant, offsets, by);

  const Sum sum(equations);
  const double at = seen.best_cost(equations, offsets, by);
  constexpr double kStep_m = 1e-3;
  for (int column = 0; column + 3 < equations.columns().count; column += 3) {
    const int axis = column / 3 % 3;
    const auto [before, after] = costs_beside(seen, equations, offsets, by, column, kStep_m);
    const double curvature = 0.5 * (after - 2.0 * at + before) / (kStep_m * kStep_m);
    // 1/m^2: 2 % for the change of the levers within a step, and 0.1 % of the information of one marker.
    EXPECT_NEAR(sum.diagonal(static_cast<std::size_t>(column + axis)), curvature,
                0.02 * curvature + 1e-3 / (by.sigma_m * by.sigma_m))
        << "column " << column;
  }
}

TEST(InstantEquations, CountTheUnknownsThatTheMarkersObserve) {
  Seen seen(8);
  InstantEquations equations(seen.set);
  const BodyOffsets offsets = offsets_of(seen.set);
  const double unknowns = 3.0 * static_cast<double>(seen.set.skeleton.bones.size() + 1);

  const double all = equations.eliminate(seen.instant, offsets, {}).observed_unknowns;
  const double none = equations.eliminate(empty_instant(seen.set), offsets, {}).observed_unknowns;

  EXPECT_GT(all, 0.6 * unknowns);
  EXPECT_LE(all, unknowns + 1e-6);
  // The root has no prior: its three coordinates and its rotation count as observed.
  EXPECT_NEAR(none, 6.0, 1e-6);
}

}  // namespace instant_equations_test
}  // namespace mocap::bodyfit
