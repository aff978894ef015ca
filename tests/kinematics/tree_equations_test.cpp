#include "kinematics/tree_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <memory>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

namespace mocap::kinematics {
namespace tree_equations_test {

struct Point {
  std::size_t link;
  Eigen::Vector3d lever;
  Eigen::Matrix3d weight;
  Eigen::Vector3d error;
};

// A random tree of seven bones with observed points and joint priors, and the same problem as one dense matrix. The
// columns of the dense Jacobian come from moving one unknown at a time.
class World {
 public:
  explicit World(unsigned seed) : random_(seed) {
    const std::vector<TreeEquations::Link> links{{-1, true}, {0, false}, {1, false}, {1, true},
                                                 {3, false}, {0, false}, {5, false}};
    for (std::size_t i = 0; i < links.size(); ++i) {
      parents_.push_back(links[i].parent);
      rotation_column_.push_back(unknowns_);
      unknowns_ += 3;
      translation_column_.push_back(links[i].has_translation ? unknowns_ : -1);
      if (links[i].has_translation) unknowns_ += 3;
      joints_.push_back(random_vector());
      rotations_.push_back({random_axes(), positive_definite(3.0), random_vector()});
      translations_.push_back({random_axes(), positive_definite(3.0), random_vector()});
    }
    for (std::size_t i = 0; i < 25; ++i)
      points_.push_back(
          {i % links.size(), random_vector(), positive_definite(i % 5 == 0 ? 0.0 : 2.0), random_vector()});
    equations_ = std::make_unique<TreeEquations>(links);
    for (std::size_t i = 0; i < links.size(); ++i) {
      equations_->joint(i) = joints_[i];
      equations_->rotation(i) = rotations_[i];
      equations_->translation(i) = translations_[i];
    }
    for (const Point& point : points_) equations_->bone(point.link).add_point(point.lever, point.weight, point.error);
    assemble_dense();
  }

  TreeEquations& equations() { return *equations_; }
  std::size_t links() const { return parents_.size(); }
  const Eigen::MatrixXd& matrix() const { return matrix_; }
  const Eigen::VectorXd& right() const { return right_; }
  int rotation_column(std::size_t link) const { return rotation_column_[link]; }
  int translation_column(std::size_t link) const { return translation_column_[link]; }

  // Derivative of the position of a point of a bone with respect to all unknowns.
  Eigen::MatrixXd point_jacobian(std::size_t link, const Eigen::Vector3d& lever) const {
    Eigen::MatrixXd columns(3, unknowns_);
    for (int u = 0; u < unknowns_; ++u) {
      const auto [w, v] = displacement(link, Eigen::VectorXd::Unit(unknowns_, u));
      columns.col(u) = v + w.cross(lever);
    }
    return columns;
  }
  Eigen::MatrixXd rotation_jacobian(std::size_t link) const {
    Eigen::MatrixXd columns(3, unknowns_);
    for (int u = 0; u < unknowns_; ++u) columns.col(u) = displacement(link, Eigen::VectorXd::Unit(unknowns_, u)).first;
    return columns;
  }
  Eigen::Vector3d random_vector() { return {normal_(random_), normal_(random_), normal_(random_)}; }

 private:
  Eigen::Matrix3d random_axes() {
    Eigen::Matrix3d m;
    m << random_vector(), random_vector(), random_vector();
    return m + 3.0 * Eigen::Matrix3d::Identity();
  }
  Eigen::Matrix3d positive_definite(double min_eigenvalue) {
    const Eigen::Vector3d a = random_vector(), b = random_vector();
    return a * a.transpose() + b * b.transpose() + min_eigenvalue * Eigen::Matrix3d::Identity();
  }
  std::pair<Eigen::Vector3d, Eigen::Vector3d> displacement(std::size_t link, const Eigen::VectorXd& x) const {
    Eigen::Vector3d w = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    if (parents_[link] >= 0) {
      const auto parent = static_cast<std::size_t>(parents_[link]);
      std::tie(w, v) = displacement(parent, x);
      v += w.cross(joints_[link] - joints_[parent]);
    }
    if (translation_column_[link] >= 0) v += translations_[link].axes * x.segment<3>(translation_column_[link]);
    w += rotations_[link].axes * x.segment<3>(rotation_column_[link]);
    return {w, v};
  }
  void assemble_dense() {
    matrix_ = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
    right_ = Eigen::VectorXd::Zero(unknowns_);
    for (const Point& point : points_) {
      const Eigen::MatrixXd columns = point_jacobian(point.link, point.lever);
      matrix_ += columns.transpose() * point.weight * columns;
      right_ -= columns.transpose() * point.weight * point.error;
    }
    for (std::size_t i = 0; i < links(); ++i) {
      matrix_.block<3, 3>(rotation_column_[i], rotation_column_[i]) += rotations_[i].weight;
      right_.segment<3>(rotation_column_[i]) -= rotations_[i].gradient;
      if (translation_column_[i] < 0) continue;
      matrix_.block<3, 3>(translation_column_[i], translation_column_[i]) += translations_[i].weight;
      right_.segment<3>(translation_column_[i]) -= translations_[i].gradient;
    }
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<int> parents_, rotation_column_, translation_column_;
  int unknowns_ = 0;
  std::vector<Eigen::Vector3d> joints_;
  std::vector<JointTerms> rotations_, translations_;
  std::vector<Point> points_;
  std::unique_ptr<TreeEquations> equations_;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd right_;
};

// Rounding error of some hundred sums of numbers between 1 and 1000.
constexpr double kRounding = 1e-8;

TEST(TreeEquations, GivesTheStepOfTheDenseEquations) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(seed);
    const Eigen::VectorXd x = world.matrix().fullPivLu().solve(world.right());

    ASSERT_TRUE(world.equations().solve(0.0));

    for (std::size_t i = 0; i < world.links(); ++i) {
      EXPECT_LT((world.equations().rotation_step(i) - x.segment<3>(world.rotation_column(i))).norm(), kRounding);
      if (world.translation_column(i) < 0) continue;
      EXPECT_LT((world.equations().translation_step(i) - x.segment<3>(world.translation_column(i))).norm(), kRounding);
    }
  }
}

TEST(TreeEquations, GivesTheCovariancesOfTheDenseInverse) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(seed);
    const Eigen::MatrixXd inverse = world.matrix().inverse();

    ASSERT_TRUE(world.equations().compute_covariances());

    for (std::size_t i = 0; i < world.links(); ++i) {
      const Eigen::Vector3d lever = world.random_vector();
      const Eigen::MatrixXd of_point = world.point_jacobian(i, lever);
      const Eigen::MatrixXd of_rotation = world.rotation_jacobian(i);
      EXPECT_LT((world.equations().covariance_of(i, lever) - of_point * inverse * of_point.transpose()).norm(),
                kRounding);
      EXPECT_LT((world.equations().rotation_covariance(i) - of_rotation * inverse * of_rotation.transpose()).norm(),
                kRounding);
      const Eigen::Matrix3d own = inverse.block<3, 3>(world.rotation_column(i), world.rotation_column(i));
      EXPECT_LT((world.equations().joint_rotation_covariance(i) - own).norm(), kRounding);
    }
  }
}

// Three joints in a chain. Only a marker beyond the last is observed, to a quarter of a millimetre. Such a marker
// observes three of nine unknowns and must not increase the variance of any.
TEST(TreeEquations, PosteriorVarianceNeverExceedsThePrior) {
  constexpr double kPrior_rad = 0.5;
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    TreeEquations arm({{-1, false}, {0, false}, {1, false}});
    const auto somewhere = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
    for (std::size_t i = 0; i < 3; ++i) {
      if (i > 0) arm.joint(i) = arm.joint(i - 1) + 0.28 * somewhere();
      arm.rotation(i).weight = Eigen::Matrix3d::Identity() / (kPrior_rad * kPrior_rad);
    }
    arm.bone(2).add_point(0.25 * somewhere(), 1.6e7, Eigen::Vector3d::Zero());

    ASSERT_TRUE(arm.compute_covariances());

    double observed = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Matrix3d remaining = arm.joint_rotation_covariance(i) / (kPrior_rad * kPrior_rad);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(remaining);
      EXPECT_GT(axes.eigenvalues().minCoeff(), -1e-3) << trial;
      EXPECT_LT(axes.eigenvalues().maxCoeff(), 1.0 + 1e-3) << trial;
      observed += 3.0 - remaining.trace();
    }
    EXPECT_NEAR(observed, 3.0, 1e-2) << trial;
  }
}

TEST(TreeEquations, DampingShortensTheStep) {
  World world(3);
  ASSERT_TRUE(world.equations().solve(0.0));
  const double undamped = world.equations().rotation_step(4).norm();

  ASSERT_TRUE(world.equations().solve(100.0));

  EXPECT_LT(world.equations().rotation_step(4).norm(), 0.1 * undamped);
}

TEST(TreeEquations, RefusesAnIndefiniteMatrix) {
  TreeEquations equations({{-1, true}, {0, false}});
  equations.rotation(0).weight = -Eigen::Matrix3d::Identity();

  EXPECT_FALSE(equations.solve(0.0));
  EXPECT_FALSE(equations.compute_covariances());
}

TEST(BoneTerms, AgreeForAScalarWeightAndAnIsotropicMatrix) {
  const Eigen::Vector3d lever(0.3, -0.2, 0.5), error(0.01, 0.02, -0.03);
  BoneTerms by_matrix, by_scalar;

  by_matrix.add_point(lever, 7.0 * Eigen::Matrix3d::Identity(), error);
  by_scalar.add_point(lever, 7.0, error);

  EXPECT_LT((by_matrix.ww - by_scalar.ww).norm() + (by_matrix.vw - by_scalar.vw).norm() +
                (by_matrix.vv - by_scalar.vv).norm(),
            1e-12);
  EXPECT_LT((by_matrix.w - by_scalar.w).norm() + (by_matrix.v - by_scalar.v).norm(), 1e-12);
}

}  // namespace tree_equations_test
}  // namespace mocap::kinematics
