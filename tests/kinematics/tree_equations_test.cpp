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
namespace {

struct Point {
  std::size_t link;
  Eigen::Vector3d lever;
  Eigen::Matrix3d weight;
  Eigen::Vector3d off;
};

// A tree of seven bones with points on them and priors in its joints, all at random; and the same problem written out
// with one dense matrix, its columns found by moving one unknown at a time.
class World {
 public:
  explicit World(unsigned seed) : random_(seed) {
    const std::vector<TreeEquations::Link> links{{-1, true}, {0, false}, {1, false}, {1, true},
                                                 {3, false}, {0, false}, {5, false}};
    for (std::size_t i = 0; i < links.size(); ++i) {
      parents_.push_back(links[i].parent);
      turn_of_.push_back(unknowns_);
      unknowns_ += 3;
      place_of_.push_back(links[i].has_translation ? unknowns_ : -1);
      if (links[i].has_translation) unknowns_ += 3;
      joints_.push_back(any());
      turns_.push_back({spread(), definite(3.0), any()});
      places_.push_back({spread(), definite(3.0), any()});
    }
    for (std::size_t i = 0; i < 25; ++i)
      points_.push_back({i % links.size(), any(), definite(i % 5 == 0 ? 0.0 : 2.0), any()});
    equations_ = std::make_unique<TreeEquations>(links);
    for (std::size_t i = 0; i < links.size(); ++i) {
      equations_->joint(i) = joints_[i];
      equations_->rotation(i) = turns_[i];
      equations_->place(i) = places_[i];
    }
    for (const Point& point : points_) equations_->bone(point.link).add_point(point.lever, point.weight, point.off);
    write_out();
  }

  TreeEquations& equations() { return *equations_; }
  std::size_t links() const { return parents_.size(); }
  const Eigen::MatrixXd& matrix() const { return matrix_; }
  const Eigen::VectorXd& right() const { return right_; }
  int turn_of(std::size_t link) const { return turn_of_[link]; }
  int place_of(std::size_t link) const { return place_of_[link]; }

  // How a point of a bone moves with the unknowns.
  Eigen::MatrixXd moves(std::size_t link, const Eigen::Vector3d& lever) const {
    Eigen::MatrixXd columns(3, unknowns_);
    for (int u = 0; u < unknowns_; ++u) {
      const auto [w, v] = displacement(link, Eigen::VectorXd::Unit(unknowns_, u));
      columns.col(u) = v + w.cross(lever);
    }
    return columns;
  }
  Eigen::MatrixXd turns(std::size_t link) const {
    Eigen::MatrixXd columns(3, unknowns_);
    for (int u = 0; u < unknowns_; ++u) columns.col(u) = displacement(link, Eigen::VectorXd::Unit(unknowns_, u)).first;
    return columns;
  }
  Eigen::Vector3d any() { return {normal_(random_), normal_(random_), normal_(random_)}; }

 private:
  Eigen::Matrix3d spread() {
    Eigen::Matrix3d m;
    m << any(), any(), any();
    return m + 3.0 * Eigen::Matrix3d::Identity();
  }
  Eigen::Matrix3d definite(double least) {
    const Eigen::Vector3d a = any(), b = any();
    return a * a.transpose() + b * b.transpose() + least * Eigen::Matrix3d::Identity();
  }
  std::pair<Eigen::Vector3d, Eigen::Vector3d> displacement(std::size_t link, const Eigen::VectorXd& x) const {
    Eigen::Vector3d w = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    if (parents_[link] >= 0) {
      const auto parent = static_cast<std::size_t>(parents_[link]);
      std::tie(w, v) = displacement(parent, x);
      v += w.cross(joints_[link] - joints_[parent]);
    }
    if (place_of_[link] >= 0) v += places_[link].axes * x.segment<3>(place_of_[link]);
    w += turns_[link].axes * x.segment<3>(turn_of_[link]);
    return {w, v};
  }
  void write_out() {
    matrix_ = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
    right_ = Eigen::VectorXd::Zero(unknowns_);
    for (const Point& point : points_) {
      const Eigen::MatrixXd columns = moves(point.link, point.lever);
      matrix_ += columns.transpose() * point.weight * columns;
      right_ -= columns.transpose() * point.weight * point.off;
    }
    for (std::size_t i = 0; i < links(); ++i) {
      matrix_.block<3, 3>(turn_of_[i], turn_of_[i]) += turns_[i].weight;
      right_.segment<3>(turn_of_[i]) -= turns_[i].gradient;
      if (place_of_[i] < 0) continue;
      matrix_.block<3, 3>(place_of_[i], place_of_[i]) += places_[i].weight;
      right_.segment<3>(place_of_[i]) -= places_[i].gradient;
    }
  }

  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  std::vector<int> parents_, turn_of_, place_of_;
  int unknowns_ = 0;
  std::vector<Eigen::Vector3d> joints_;
  std::vector<JointTerms> turns_, places_;
  std::vector<Point> points_;
  std::unique_ptr<TreeEquations> equations_;
  Eigen::MatrixXd matrix_;
  Eigen::VectorXd right_;
};

// Some hundred sums of numbers about 1 to 1000.
constexpr double kRounding = 1e-8;

TEST(TreeEquations, GivesTheStepThatTheDenseEquationsGive) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(seed);
    const Eigen::VectorXd x = world.matrix().fullPivLu().solve(world.right());

    ASSERT_TRUE(world.equations().solve(0.0));

    for (std::size_t i = 0; i < world.links(); ++i) {
      EXPECT_LT((world.equations().rotation_step(i) - x.segment<3>(world.turn_of(i))).norm(), kRounding);
      if (world.place_of(i) < 0) continue;
      EXPECT_LT((world.equations().translation_step(i) - x.segment<3>(world.place_of(i))).norm(), kRounding);
    }
  }
}

TEST(TreeEquations, GivesTheCovariancesThatTheDenseInverseGives) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    World world(seed);
    const Eigen::MatrixXd inverse = world.matrix().inverse();

    ASSERT_TRUE(world.equations().compute_covariances());

    for (std::size_t i = 0; i < world.links(); ++i) {
      const Eigen::Vector3d lever = world.any();
      const Eigen::MatrixXd moves = world.moves(i, lever);
      const Eigen::MatrixXd turns = world.turns(i);
      EXPECT_LT((world.equations().covariance_of(i, lever) - moves * inverse * moves.transpose()).norm(), kRounding);
      EXPECT_LT((world.equations().rotation_covariance(i) - turns * inverse * turns.transpose()).norm(), kRounding);
      const Eigen::Matrix3d own = inverse.block<3, 3>(world.turn_of(i), world.turn_of(i));
      EXPECT_LT((world.equations().joint_rotation_covariance(i) - own).norm(), kRounding);
    }
  }
}

// Three joints in a row of which a marker beyond the last, known to a quarter of a millimetre, is all that is seen: it
// tells three of nine unknowns, and none is known worse than before.
TEST(TreeEquations, KnowsNoTurnWorseWithAMarkerThanWithout) {
  constexpr double kBefore_rad = 0.5;
  std::mt19937 random(8);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 200; ++trial) {
    TreeEquations arm({{-1, false}, {0, false}, {1, false}});
    const auto somewhere = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized(); };
    for (std::size_t i = 0; i < 3; ++i) {
      if (i > 0) arm.joint(i) = arm.joint(i - 1) + 0.28 * somewhere();
      arm.rotation(i).weight = Eigen::Matrix3d::Identity() / (kBefore_rad * kBefore_rad);
    }
    arm.bone(2).add_point(0.25 * somewhere(), 1.6e7, Eigen::Vector3d::Zero());

    ASSERT_TRUE(arm.compute_covariances());

    double told = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Matrix3d share = arm.joint_rotation_covariance(i) / (kBefore_rad * kBefore_rad);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(share);
      EXPECT_GT(axes.eigenvalues().minCoeff(), -1e-3) << trial;
      EXPECT_LT(axes.eigenvalues().maxCoeff(), 1.0 + 1e-3) << trial;
      told += 3.0 - share.trace();
    }
    EXPECT_NEAR(told, 3.0, 1e-2) << trial;
  }
}

TEST(TreeEquations, TakesAShorterStepWhereItIsDamped) {
  World world(3);
  ASSERT_TRUE(world.equations().solve(0.0));
  const double whole = world.equations().rotation_step(4).norm();

  ASSERT_TRUE(world.equations().solve(100.0));

  EXPECT_LT(world.equations().rotation_step(4).norm(), 0.1 * whole);
}

TEST(TreeEquations, RefusesWhatTellsNothing) {
  TreeEquations equations({{-1, true}, {0, false}});
  equations.rotation(0).weight = -Eigen::Matrix3d::Identity();

  EXPECT_FALSE(equations.solve(0.0));
  EXPECT_FALSE(equations.compute_covariances());
}

TEST(BoneTerms, AreTheSameForAWeightThatIsAlikeInAllDirections) {
  const Eigen::Vector3d lever(0.3, -0.2, 0.5), off(0.01, 0.02, -0.03);
  BoneTerms whole, alike;

  whole.add_point(lever, 7.0 * Eigen::Matrix3d::Identity(), off);
  alike.add_point(lever, 7.0, off);

  EXPECT_LT((whole.ww - alike.ww).norm() + (whole.vw - alike.vw).norm() + (whole.vv - alike.vv).norm(), 1e-12);
  EXPECT_LT((whole.w - alike.w).norm() + (whole.v - alike.v).norm(), 1e-12);
}

}  // namespace
}  // namespace mocap::kinematics
