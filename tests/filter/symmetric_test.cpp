#include "filter/symmetric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "filter/random.h"

namespace mocap::filter {
namespace symmetric_test {

// No unit: rounding of products of numbers near 1.
constexpr double kRounding = 1e-9;

// A symmetric matrix with elements near 1 that is positive definite, or not.
template <int N>
Matrix<N> random_symmetric(Random& random, bool positive) {
  Matrix<N> root;
  for (double& element : root.reshaped()) element = random.normal();
  return positive ? Matrix<N>(root * root.transpose() + 0.1 * Matrix<N>::Identity())
                  : Matrix<N>(root + root.transpose());
}

template <int N>
void expect_inverses() {
  Random random(5);
  for (int trial = 0; trial < 100; ++trial) {
    const Matrix<N> m = random_symmetric<N>(random, trial % 2 == 0);

    const Cofactors<N> cofactors(m);

    EXPECT_NEAR(cofactors.determinant, m.determinant(), kRounding * (1.0 + std::pow(m.norm(), N)));
    const Matrix<N> product = m * cofactors.adjugate;
    EXPECT_LT((product - cofactors.determinant * Matrix<N>::Identity()).norm(),
              kRounding * (1.0 + std::pow(m.norm(), N)));
    if (trial % 2 == 0) {
      EXPECT_LT((m * inverse_of<N>(m) - Matrix<N>::Identity()).norm(), 1e-6);
    }  // condition up to 1000
  }
}

TEST(Cofactors, AreThoseOfSymmetricMatricesOfTwoAndThreeDimensions) {
  expect_inverses<2>();
  expect_inverses<3>();
}

TEST(Cofactors, ReadOnlyTheLowerTriangle) {
  Matrix<3> m;
  m << 2.0, 9.0, 9.0, 0.5, 3.0, 9.0, 0.25, -0.5, 4.0;
  Matrix<3> symmetric = m;
  symmetric.triangularView<Eigen::StrictlyUpper>() = m.transpose();

  EXPECT_EQ(inverse_of<3>(m), inverse_of<3>(symmetric));
}

TEST(Cofactors, HaveNoDeterminantIfTheMatrixIsSingular) {
  const Vector<3> direction(1.0, 2.0, -3.0);

  const Cofactors<3> cofactors(direction * direction.transpose());

  EXPECT_EQ(cofactors.determinant, 0.0);
  EXPECT_EQ(cofactors.adjugate.norm(), 0.0);
  EXPECT_FALSE(inverse_of<3>(Matrix<3>::Zero()).allFinite());
}

}  // namespace symmetric_test
}  // namespace mocap::filter
