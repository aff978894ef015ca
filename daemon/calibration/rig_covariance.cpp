#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>

#include "calibration/bundle.h"
#include "calibration/bundle_problem.h"

namespace mocap::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr int kPoseSize = BundleProblem::kPoseSize;
constexpr int kWandPoseDof = BundleProblem::kWandPoseDof;
using WandPoseMatrix = Eigen::Matrix<double, kWandPoseDof, kWandPoseDof>;

// Smallest eigenvalue of the normal matrix, scaled to a unit diagonal: below it, the observations do not determine the
// rig. About 50 times the rounding error of a double. Chosen by hand; not yet measured.
constexpr double kMinEigenvalue = 1e-14;

// Weight of the rotations of the cameras in the gauge constraints, as a fraction of the squared size of the rig: so
// small that it changes no figure of a rig whose camera centres fix the gauge, and far above rounding. It fixes the
// rotation about the line through the centres of two cameras.
constexpr double kGaugeWeightOfRotations = 1e-6;

// Jacobian of all residuals: first the columns of the camera poses, then those of the free intrinsics, then 5 columns a
// wand pose.
ceres::CRSMatrix jacobian_of(BundleProblem& problem, const Bundle& bundle) {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) options.parameter_blocks.push_back(problem.pose(c));
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    if (!problem.get().IsParameterBlockConstant(problem.intrinsics(c)))
      options.parameter_blocks.push_back(problem.intrinsics(c));
  }
  for (std::size_t p = 0; p < bundle.wand_poses.size(); ++p) {
    if (problem.has_wand_pose(p)) options.parameter_blocks.push_back(problem.wand_pose(p));
  }
  ceres::CRSMatrix jacobian;
  problem.get().Evaluate(options, nullptr, nullptr, nullptr, &jacobian);
  return jacobian;
}

// Normal matrix of the camera parameters with the wand poses eliminated (Schur complement).
MatrixXd reduced_normal_matrix(BundleProblem& problem, const Bundle& bundle, int camera_columns) {
  const ceres::CRSMatrix jacobian = jacobian_of(problem, bundle);
  const auto n = static_cast<Eigen::Index>(camera_columns);
  MatrixXd cameras = MatrixXd::Zero(n, n);
  const auto wand_poses = static_cast<std::size_t>((jacobian.num_cols - camera_columns) / kWandPoseDof);
  std::vector<WandPoseMatrix> own(wand_poses, WandPoseMatrix::Zero());          // wand pose x wand pose
  std::vector<MatrixXd> coupling(wand_poses, MatrixXd::Zero(kWandPoseDof, n));  // wand pose x cameras
  for (int row = 0; row < jacobian.num_rows; ++row) {
    const int begin = jacobian.rows[static_cast<std::size_t>(row)];
    const int end = jacobian.rows[static_cast<std::size_t>(row) + 1];
    for (int i = begin; i < end; ++i) {
      const int ci = jacobian.cols[static_cast<std::size_t>(i)];
      const double vi = jacobian.values[static_cast<std::size_t>(i)];
      for (int j = begin; j < end; ++j) {
        const int cj = jacobian.cols[static_cast<std::size_t>(j)];
        const double product = vi * jacobian.values[static_cast<std::size_t>(j)];
        if (ci < n && cj < n) {
          cameras(ci, cj) += product;
        } else if (ci >= n && cj < n) {
          coupling[static_cast<std::size_t>((ci - n) / kWandPoseDof)]((ci - n) % kWandPoseDof, cj) += product;
        } else if (ci >= n && cj >= n) {
          own[static_cast<std::size_t>((ci - n) / kWandPoseDof)]((ci - n) % kWandPoseDof, (cj - n) % kWandPoseDof) +=
              product;
        }
      }
    }
  }
  for (std::size_t p = 0; p < wand_poses; ++p) {
    own[p].diagonal().array() += 1e-12;
    cameras.noalias() -= coupling[p].transpose() * own[p].ldlt().solve(coupling[p]);
  }
  return cameras;
}

// Derivative of a camera's centre (rows 0 to 2) and of its rotation in world axes (rows 3 to 5) by its six pose
// parameters. Central differences.
Matrix6 world_jacobian_of_pose(const double* pose) {
  const auto decode = [](const Vector6& p) {
    const double angle = p.head<3>().norm();
    const Eigen::Matrix3d rotation =
        angle > 0.0 ? Eigen::AngleAxisd(angle, p.head<3>() / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    return std::pair<Eigen::Matrix3d, Vector3d>{rotation, -(rotation.transpose() * p.tail<3>())};
  };
  const Vector6 at = Eigen::Map<const Vector6>(pose);
  constexpr double kStep = 1e-6;
  Matrix6 jacobian;
  for (int i = 0; i < 6; ++i) {
    Vector6 up = at;
    Vector6 down = at;
    up[i] += kStep;
    down[i] -= kStep;
    const auto [rotation_up, centre_up] = decode(up);
    const auto [rotation_down, centre_down] = decode(down);
    jacobian.col(i).head<3>() = (centre_up - centre_down) / (2.0 * kStep);
    const Eigen::AngleAxisd difference(Eigen::Matrix3d(rotation_up.transpose() * rotation_down));
    jacobian.col(i).tail<3>() = difference.angle() * difference.axis() / (2.0 * kStep);
  }
  return jacobian;
}

// Six constraints on a change of the parameters, one a column: the camera centres as a whole neither move nor rotate;
// nor do the cameras about a line on which all centres are.
MatrixXd gauge_constraints(const Rig& rig, const std::vector<Matrix6>& jacobians, int rows) {
  MatrixXd gauge = MatrixXd::Zero(rows, 6);
  Vector3d middle = Vector3d::Zero();
  for (const CameraModel& camera : rig) middle += camera.centre().v / static_cast<double>(rig.size());
  double size_m2 = 0.0;
  for (const CameraModel& camera : rig) size_m2 += (camera.centre().v - middle).squaredNorm();
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const Eigen::Matrix<double, 3, 6> centre_jacobian = jacobians[c].topRows<3>();
    const Eigen::Matrix<double, 3, 6> rotation_jacobian = jacobians[c].bottomRows<3>();
    const Vector3d arm = rig[c].centre().v - middle;
    const auto first = static_cast<Eigen::Index>(kPoseSize * c);
    gauge.block<6, 3>(first, 0) = centre_jacobian.transpose();
    for (int axis = 0; axis < 3; ++axis)
      gauge.block<6, 1>(first, 3 + axis) =
          centre_jacobian.transpose() * Vector3d::Unit(axis).cross(arm) +
          kGaugeWeightOfRotations * size_m2 * rotation_jacobian.transpose() * Vector3d::Unit(axis);
  }
  return gauge;
}

}  // namespace

RigCovariance rig_covariance(const Bundle& bundle, FreeIntrinsics free_intrinsics, double variance) {
  BundleSettings settings;
  settings.free_intrinsics = free_intrinsics;
  settings.loss_scale_sigmas = 0.0;
  settings.fix_first_camera = false;
  BundleProblem problem(bundle, settings);
  const std::size_t cameras = bundle.rig.size();
  int n = kPoseSize * static_cast<int>(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    if (!problem.has_camera(c)) return {};
    const FreeIntrinsics free = bundle.free_intrinsics(c, free_intrinsics);
    n += static_cast<int>(free_intrinsic_indices(free, bundle.rig[c].lens.kind).size());
  }
  const MatrixXd normal = reduced_normal_matrix(problem, bundle, n);
  std::vector<Matrix6> jacobians;
  for (std::size_t c = 0; c < cameras; ++c) jacobians.push_back(world_jacobian_of_pose(problem.pose(c)));

  // An orthonormal basis of the changes that obey the gauge constraints: the last n - 6 columns of the full Q.
  const MatrixXd gauge = gauge_constraints(bundle.rig, jacobians, n);
  const MatrixXd full = Eigen::HouseholderQR<MatrixXd>(gauge).householderQ() * MatrixXd::Identity(n, n);
  const MatrixXd basis = full.rightCols(n - 6);
  // Scaled to a unit diagonal, because the parameters have the units m, rad and px.
  MatrixXd inner = basis.transpose() * normal * basis;
  const Eigen::VectorXd scale = inner.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  inner = scale.asDiagonal() * inner * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(inner);
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] < kMinEigenvalue) return {};
  const MatrixXd root =
      basis * scale.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().cwiseSqrt().asDiagonal();
  RigCovariance result;
  MatrixXd spread(static_cast<Eigen::Index>(kPoseSize * cameras), root.cols());
  for (std::size_t c = 0; c < cameras; ++c) {
    const auto first = static_cast<Eigen::Index>(kPoseSize * c);
    spread.middleRows(first, kPoseSize) = std::sqrt(variance) * jacobians[c] * root.middleRows(first, kPoseSize);
    result.cameras.push_back({spread.middleRows(first, 3).norm(), spread.middleRows(first + 3, 3).norm()});
  }
  result.covariance = spread * spread.transpose();
  return result;
}

}  // namespace mocap::calibration
