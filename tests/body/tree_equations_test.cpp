#include "body/tree_equations.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <vector>

namespace mocap::body {
namespace {

TEST(TreeEquations, WhitenGivesTheVarianceThatTheDenseInverseGives) {
  const std::vector<int> parents{-1, 0, 1, 1, 3, 0};
  const std::vector<int> chain{0, 1, 3, 4};
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  TreeEquations equations(parents);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(6, 6);
  for (int i = 0; i < 6; ++i) {
    // One measurement of each unknown and all above it.
    Eigen::VectorXd row = Eigen::VectorXd::Zero(6);
    for (int j = i; j >= 0; j = parents[static_cast<std::size_t>(j)]) row[j] = normal(random) + (i == j ? 3.0 : 0.0);
    dense += row * row.transpose();
  }
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j >= 0; j = parents[static_cast<std::size_t>(j)])
      equations.add(static_cast<std::size_t>(i), static_cast<std::size_t>(j), dense(i, j));
  }
  std::vector<double> v{0.3, -1.0, 0.5, 2.0};
  Eigen::VectorXd full = Eigen::VectorXd::Zero(6);
  for (std::size_t i = 0; i < chain.size(); ++i) full[chain[i]] = v[i];

  ASSERT_TRUE(equations.factor());
  equations.whiten(chain, v);

  double variance = 0.0;
  for (const double x : v) variance += x * x;
  // The factor adds 1e-9 to a diagonal of about 1 to 10.
  EXPECT_NEAR(variance, full.dot(dense.inverse() * full), 1e-6);
}

}  // namespace
}  // namespace mocap::body
