#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>

#include "calibration/bundle.h"
#include "calibration/bundle_problem.h"

namespace mocap::calibration {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int kPose = BundleProblem::kPose;
constexpr int kPlace = BundleProblem::kFreePlace;
// The cost must rise by more than this share of its steepest direction, or the sights do not determine the rig.
constexpr double kLeastCurvature = 1e-14;

// Cost's curvature by the cameras alone: at every place of the wand, the place follows the cameras.
MatrixXd cameras_curvature(BundleProblem& problem, const Bundle& bundle, int columns_of_cameras) {
  ceres::Problem::EvaluateOptions options;
  options.apply_loss_function = false;
  std::vector<int> column_of_place(bundle.places.size(), -1);
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) options.parameter_blocks.push_back(problem.pose(c));
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    if (columns_of_cameras > kPose * static_cast<int>(bundle.rig.size()))
      options.parameter_blocks.push_back(problem.lens(c));
  }
  int next = columns_of_cameras;
  for (std::size_t p = 0; p < bundle.places.size(); ++p) {
    if (!problem.place_used(p)) continue;
    options.parameter_blocks.push_back(problem.place(p));
    column_of_place[p] = next;
    next += kPlace;
  }
  ceres::CRSMatrix jacobian;
  problem.get().Evaluate(options, nullptr, nullptr, nullptr, &jacobian);

  // Rows of one place are gathered: its own 5 x 5, and its 5 x cameras.
  const auto n = static_cast<Eigen::Index>(columns_of_cameras);
  MatrixXd cameras = MatrixXd::Zero(n, n);
  const auto places = static_cast<std::size_t>((next - columns_of_cameras) / kPlace);
  std::vector<Eigen::Matrix<double, kPlace, kPlace>> own(places, Eigen::Matrix<double, kPlace, kPlace>::Zero());
  std::vector<MatrixXd> with(places, MatrixXd::Zero(kPlace, n));
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
          with[static_cast<std::size_t>((ci - n) / kPlace)]((ci - n) % kPlace, cj) += product;
        } else if (ci >= n && cj >= n) {
          own[static_cast<std::size_t>((ci - n) / kPlace)]((ci - n) % kPlace, (cj - n) % kPlace) += product;
        }
      }
    }
  }
  for (std::size_t p = 0; p < places; ++p) {
    own[p].diagonal().array() += 1e-12;
    cameras.noalias() -= with[p].transpose() * own[p].ldlt().solve(with[p]);
  }
  return cameras;
}

// How a camera's centre and its turn in the world move with the six numbers of its pose.
Eigen::Matrix<double, 6, 6> slope_of_pose(const double* pose) {
  const auto place = [](const Eigen::Matrix<double, 6, 1>& p) {
    const double angle = p.head<3>().norm();
    const Eigen::Matrix3d turn =
        angle > 0.0 ? Eigen::AngleAxisd(angle, p.head<3>() / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
    return std::pair<Eigen::Matrix3d, Vector3d>{turn, -(turn.transpose() * p.tail<3>())};
  };
  const Eigen::Matrix<double, 6, 1> at = Eigen::Map<const Eigen::Matrix<double, 6, 1>>(pose);
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 6, 6> slope;
  for (int i = 0; i < 6; ++i) {
    Eigen::Matrix<double, 6, 1> up = at;
    Eigen::Matrix<double, 6, 1> down = at;
    up[i] += kStep;
    down[i] -= kStep;
    const auto [turn_up, centre_up] = place(up);
    const auto [turn_down, centre_down] = place(down);
    slope.col(i).head<3>() = (centre_up - centre_down) / (2.0 * kStep);
    const Eigen::AngleAxisd turned(Eigen::Matrix3d(turn_up.transpose() * turn_down));
    slope.col(i).tail<3>() = turned.angle() * turned.axis() / (2.0 * kStep);  // in the world's axes, camera to world
  }
  return slope;
}

}  // namespace

RigDoubt doubt_of(const Bundle& bundle, LensFreedom lens, double variance) {
  BundleSettings settings;
  settings.lens = lens;
  settings.outlier_sigmas = 0.0;
  settings.hold_first = false;
  BundleProblem problem(bundle, settings);
  const std::size_t cameras = bundle.rig.size();
  int n = kPose * static_cast<int>(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    if (!problem.camera_used(c)) return {};
    n += static_cast<int>(free_lens_parts(lens, bundle.rig[c].lens.kind).size());
  }
  const MatrixXd curvature = cameras_curvature(problem, bundle, n);

  // The centres as a whole neither move nor turn: six equations that a change of the rig must obey.
  MatrixXd gauge = MatrixXd::Zero(n, 6);
  std::vector<Eigen::Matrix<double, 6, 6>> slopes;
  Vector3d middle = Vector3d::Zero();
  for (const CameraModel& camera : bundle.rig) middle += camera.centre().v / static_cast<double>(cameras);
  for (std::size_t c = 0; c < cameras; ++c) {
    slopes.push_back(slope_of_pose(problem.pose(c)));
    const Eigen::Matrix<double, 3, 6> moves = slopes[c].topRows<3>();
    const Vector3d arm = bundle.rig[c].centre().v - middle;
    const auto first = static_cast<Eigen::Index>(kPose * c);
    gauge.block<6, 3>(first, 0) = moves.transpose();
    for (int axis = 0; axis < 3; ++axis)
      gauge.block<6, 1>(first, 3 + axis) = moves.transpose() * Vector3d::Unit(axis).cross(arm);
  }
  const MatrixXd full = Eigen::HouseholderQR<MatrixXd>(gauge).householderQ() * MatrixXd::Identity(n, n);
  const MatrixXd free = full.rightCols(n - 6);
  // Scaled, since m, rad and px stand side by side.
  MatrixXd inner = free.transpose() * curvature * free;
  const Eigen::VectorXd scale = inner.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  inner = scale.asDiagonal() * inner * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(inner);
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] < kLeastCurvature) return {};
  const MatrixXd root =
      free * scale.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().cwiseSqrt().asDiagonal();
  RigDoubt doubt;
  MatrixXd spread(static_cast<Eigen::Index>(kPose * cameras), root.cols());
  for (std::size_t c = 0; c < cameras; ++c) {
    const auto first = static_cast<Eigen::Index>(kPose * c);
    spread.middleRows(first, kPose) = std::sqrt(variance) * slopes[c] * root.middleRows(first, kPose);
    doubt.cameras.push_back({spread.middleRows(first, 3).norm(), spread.middleRows(first + 3, 3).norm()});
  }
  doubt.covariance = spread * spread.transpose();
  return doubt;
}

}  // namespace mocap::calibration
