#include "bodyfit/offset_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "support/test_body.h"

namespace mocap::bodyfit {
namespace offset_equations_test {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

struct Body {
  explicit Body(std::uint32_t seed) : random(seed) {}

  // Changes each offset by up to `by_m` on each axis.
  void disturb(double by_m) {
    std::uniform_real_distribution<double> flat(-by_m, by_m);
    for (auto* list : {&offsets.bones_m, &offsets.markers_m}) {
      for (Vector3d& offset : *list) offset += Vector3d(flat(random), flat(random), flat(random));
    }
  }
  // Adds the information of `rows` random measurements, each a linear combination of all unknowns.
  void add_random_information(int rows) {
    std::normal_distribution<double> normal(0.0, 100.0);
    const auto width = static_cast<std::size_t>(columns.count);
    for (int row = 0; row < rows; ++row) {
      std::vector<double> slope(width);
      for (double& one : slope) one = normal(random);
      const double error = 0.01 * normal(random);
      for (std::size_t i = 0; i < width; ++i) {
        equations.gradient()[i] += slope[i] * error;
        for (std::size_t j = 0; j <= i; ++j) equations.matrix()[i * width + j] += slope[i] * slope[j];
      }
    }
  }
  MatrixXd dense_matrix() {
    const auto width = static_cast<Eigen::Index>(columns.count);
    const Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> lower(
        equations.matrix().data(), width, width);
    return MatrixXd(lower).selfadjointView<Eigen::Lower>();
  }
  // The unknowns, by column.
  VectorXd unknowns() const {
    VectorXd all(columns.count);
    for (std::size_t b = 1; b < columns.bone.size(); ++b) all.segment<3>(columns.bone[b]) = offsets.bones_m[b];
    for (std::size_t m = 0; m < columns.marker.size(); ++m) all.segment<3>(columns.marker[m]) = offsets.markers_m[m];
    all[columns.size_column] = size;
    return all;
  }
  void set_unknowns(const VectorXd& all) {
    for (std::size_t b = 1; b < columns.bone.size(); ++b) offsets.bones_m[b] = all.segment<3>(columns.bone[b]);
    for (std::size_t m = 0; m < columns.marker.size(); ++m) offsets.markers_m[m] = all.segment<3>(columns.marker[m]);
    size = all[columns.size_column];
  }

  std::mt19937 random;
  MarkerSet file = test::person("baseline41");
  OffsetColumns columns{file};
  OffsetEquations equations{file, columns, OffsetPriors{}};
  BodyOffsets offsets = offsets_of(file);
  double size = 1.0;
};

TEST(OffsetEquations, HaveTheGradientOfTheCostOfThePriors) {
  Body body(1);
  body.disturb(0.03);  // up to two standard deviations, where the robust cost of the markers is far from quadratic
  body.size = 1.1;

  body.equations.add_priors(body.offsets, body.size);

  const VectorXd at = body.unknowns();
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    constexpr double kStep = 1e-6;  // m, and 1 for the size
    VectorXd moved = at;
    moved[i] += kStep;
    body.set_unknowns(moved);
    const double after = body.equations.prior_cost(body.offsets, body.size);
    moved[i] -= 2.0 * kStep;
    body.set_unknowns(moved);
    const double before = body.equations.prior_cost(body.offsets, body.size);
    const double gradient = body.equations.gradient()[static_cast<std::size_t>(i)];
    // The equations are those of half the cost. 1/m: rounding of a difference of costs near 1000.
    EXPECT_NEAR(gradient, 0.5 * (after - before) / (2.0 * kStep), 1e-5 * std::abs(gradient) + 1e-2) << "column " << i;
  }
}

TEST(OffsetEquations, CostNothingForTheBodyOfTheFile) {
  Body body(2);

  EXPECT_EQ(body.equations.prior_cost(body.offsets, 1.0), 0.0);
  body.equations.add_priors(body.offsets, 1.0);
  for (const double g : body.equations.gradient()) EXPECT_EQ(g, 0.0);
  body.disturb(0.01);
  EXPECT_GT(body.equations.prior_cost(body.offsets, 1.0), 1.0);
}

TEST(OffsetEquations, CostLittleForALargerBodyOfTheSameProportions) {
  Body body(3);
  for (auto* list : {&body.offsets.bones_m, &body.offsets.markers_m}) {
    for (Vector3d& offset : *list) offset *= 1.15;
  }

  // One standard deviation of the size, and nothing else.
  EXPECT_NEAR(body.equations.prior_cost(body.offsets, 1.15), 1.0, 1e-9);
  EXPECT_GT(body.equations.prior_cost(body.offsets, 1.0), 20.0);
}

TEST(OffsetEquations, SolveAsADenseFactorisationDoes) {
  for (const double damping : {0.0, 0.5}) {
    Body body(4);
    body.disturb(0.01);
    body.equations.add_priors(body.offsets, body.size);
    body.add_random_information(60);
    MatrixXd damped = body.dense_matrix();
    damped.diagonal() *= 1.0 + damping;
    const Eigen::Map<const VectorXd> gradient(body.equations.gradient().data(), body.columns.count);
    const VectorXd expected = damped.ldlt().solve(-gradient);
    const VectorXd before = body.unknowns();

    body.equations.begin_solve(damping);
    ASSERT_TRUE(body.equations.work(100'000'000));
    ASSERT_TRUE(body.equations.solved());
    const double largest = body.equations.apply(body.offsets, body.size);

    EXPECT_LT((body.unknowns() - before - expected).norm(), 1e-8 * expected.norm());
    double expected_largest = 0.0;
    for (Eigen::Index i = 0; i + 3 < expected.size(); i += 3)
      expected_largest = std::max(expected_largest, expected.segment<3>(i).norm());
    EXPECT_NEAR(largest, expected_largest, 1e-8 * expected_largest);
  }
}

TEST(OffsetEquations, GiveTheSameSolutionInSmallStepsOfWork) {
  Body whole(5), in_steps(5);
  for (Body* body : {&whole, &in_steps}) {
    body->disturb(0.01);
    body->equations.add_priors(body->offsets, body->size);
    body->add_random_information(30);
    body->equations.begin_solve(0.01);
  }

  ASSERT_TRUE(whole.equations.work(100'000'000));
  int calls = 1;
  while (!in_steps.equations.work(5'000)) ASSERT_LT(++calls, 10'000);

  EXPECT_GT(calls, 20);
  whole.equations.apply(whole.offsets, whole.size);
  in_steps.equations.apply(in_steps.offsets, in_steps.size);
  EXPECT_EQ(whole.unknowns(), in_steps.unknowns());
}

TEST(OffsetEquations, ReportEquationsWithoutASolution) {
  Body body(6);
  body.equations.clear();

  body.equations.begin_solve(0.0);

  EXPECT_TRUE(body.equations.work(100'000'000));
  EXPECT_FALSE(body.equations.solved());
}

TEST(OffsetEquations, CountTheUnknownsThatTheInstantsDetermine) {
  Body body(7);
  body.equations.add_priors(body.offsets, body.size);
  body.equations.begin_solve(0.0);
  ASSERT_TRUE(body.equations.work(100'000'000));
  const double without_instants = body.equations.observed_unknowns();
  // Nine unknowns of three markers, each a thousand times more precise than the prior.
  body.equations.clear();
  body.equations.add_priors(body.offsets, body.size);
  const auto width = static_cast<std::size_t>(body.columns.count);
  for (const std::size_t marker : {5U, 10U, 20U}) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<std::size_t>(body.columns.marker[marker] + axis);
      body.equations.matrix()[i * width + i] *= 1e6;
    }
  }
  body.equations.begin_solve(0.0);
  ASSERT_TRUE(body.equations.work(100'000'000));

  EXPECT_NEAR(without_instants, 0.0, 1e-6);
  EXPECT_NEAR(body.equations.observed_unknowns(), 9.0, 1.0);
}

TEST(OffsetEquations, ReturnADisturbedBodyToThatOfTheFile) {
  Body body(8);
  body.disturb(0.01);
  body.size = 1.05;

  double largest = 1.0;
  for (int i = 0; i < 30 && largest > 1e-7; ++i) {
    body.equations.clear();
    body.equations.add_priors(body.offsets, body.size);
    body.equations.begin_solve(0.0);
    ASSERT_TRUE(body.equations.work(100'000'000) && body.equations.solved());
    largest = body.equations.apply(body.offsets, body.size);
  }

  EXPECT_LT(body.equations.prior_cost(body.offsets, body.size), 1e-6);
  EXPECT_NEAR(body.size, 1.0, 1e-6);
  EXPECT_LT((body.offsets.markers_m[7] - body.file.markers[7].offset_m).norm(), 1e-6);
}

TEST(OffsetPriors, OfAFittedBodyHoldTheBonesMoreTightlyThanTheMarkers) {
  const MarkerSet file = test::person("baseline41");
  const OffsetColumns columns(file);
  const OffsetEquations of_file(file, columns, {}), of_fitted(file, columns, priors_of_fitted());
  BodyOffsets longer = offsets_of(file), moved = longer;
  longer.bones_m[test::bone_named(file, "LeftLowArm")] *= 1.05;
  moved.markers_m[test::marker_named(file, "LThigh")] += Vector3d(0.0, 0.0, 0.01);

  EXPECT_GT(of_fitted.prior_cost(longer, 1.0), 10.0 * of_file.prior_cost(longer, 1.0));
  EXPECT_LT(of_fitted.prior_cost(moved, 1.0), 10.0 * of_file.prior_cost(moved, 1.0));
}

TEST(OffsetPriors, CanBeReplaced) {
  const MarkerSet file = test::person("baseline41");
  const OffsetColumns columns(file);
  const OffsetEquations of_file(file, columns, {});
  OffsetEquations replaced(file, columns, priors_of_fitted());
  BodyOffsets other = offsets_of(file);
  for (Vector3d& bone_m : other.bones_m) bone_m *= 1.05;
  for (Vector3d& marker_m : other.markers_m) marker_m += Vector3d(0.0, 0.0, 0.01);

  replaced.set_priors({});

  EXPECT_EQ(replaced.prior_cost(other, 1.02), of_file.prior_cost(other, 1.02));
}

}  // namespace offset_equations_test
}  // namespace mocap::bodyfit
