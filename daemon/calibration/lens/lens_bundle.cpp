#include "calibration/lens/lens_bundle.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "calibration/distort_ray.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix29 = Eigen::Matrix<double, 2, kIntrinsicCount>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix96 = Eigen::Matrix<double, kIntrinsicCount, 6>;

constexpr std::size_t kMinRays = 6;
constexpr double kCostTolerance = 1e-11;  // relative decrease of the cost at which the iterations stop
// Residual of a corner behind the camera: larger than any other, but finite, so that a trial step is only rejected.
constexpr double kInvisibleResidual_px = 1e3;
// Smallest eigenvalue of the normal matrix, scaled to a unit diagonal: below it, the views do not determine the
// parameters. Chosen by hand; not yet measured.
constexpr double kMinEigenvalue = 1e-13;

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

CameraFromWorld moved(const CameraFromWorld& pose, const Vector6& step) {
  const double angle = step.head<3>().norm();
  const Matrix3d rotation = angle > 0.0 ? Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix()
                                        : Matrix3d(Matrix3d::Identity());
  return {rotation * pose.rotation, pose.translation + step.tail<3>()};
}

// One corner, linearised.
struct Corner {
  Vector2d residual_px;    // observed minus projected
  Matrix29 by_intrinsics;  // derivatives of the projection
  Matrix26 by_pose;        // by a rotation about the board's origin, in camera axes, and by a translation
};

std::optional<Corner> linearise(const Lens& lens, const CameraFromWorld& pose, const Vector2d& on_board,
                                const Vector2d& seen) {
  const Vector3d rotated = pose.rotation * Vector3d(on_board.x(), on_board.y(), 0.0);
  const Vector3d at = rotated + pose.translation;
  if (at.z() < kMinDepth_m) return std::nullopt;
  const Vector2d ray = at.head<2>() / at.z();
  const geometry::DistortedRay distorted = geometry::distort_with_slope(lens, {ray});
  Eigen::Matrix<double, 2, 3> ray_by_point;
  ray_by_point << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  const Eigen::Matrix<double, 2, 3> by_point = distorted.px_from_ray * ray_by_point / at.z();
  Corner corner;
  corner.residual_px = seen - distorted.pixel.v;
  corner.by_intrinsics = pixel_jacobian(lens, ray);
  corner.by_pose << -by_point * cross(rotated), by_point;
  return corner;
}

// The normal equations in blocks: the intrinsics, each board pose, and the coupling of both.
struct Equations {
  IntrinsicMatrix lens = IntrinsicMatrix::Zero();
  IntrinsicVector lens_rhs = IntrinsicVector::Zero();
  std::vector<Matrix6> board;
  std::vector<Vector6> board_rhs;
  std::vector<Matrix96> coupling;
};

Equations build_equations(const LensBundle& bundle, const IntrinsicMask& parameters) {
  Equations equations;
  const IntrinsicVector used = parameters.cast<double>();
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    Matrix6 board = Matrix6::Zero();
    Vector6 rhs = Vector6::Zero();
    Matrix96 coupling = Matrix96::Zero();
    const BoardView& view = bundle.views[v];
    for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
      const auto corner = linearise(bundle.lens, bundle.camera_from_board[v], view.board_m[i], view.seen_px[i]);
      if (!corner) continue;
      const Matrix29 by_intrinsics = corner->by_intrinsics * used.asDiagonal();
      equations.lens += by_intrinsics.transpose() * by_intrinsics;
      equations.lens_rhs += by_intrinsics.transpose() * corner->residual_px;
      board += corner->by_pose.transpose() * corner->by_pose;
      rhs += corner->by_pose.transpose() * corner->residual_px;
      coupling += by_intrinsics.transpose() * corner->by_pose;
    }
    equations.board.push_back(board);
    equations.board_rhs.push_back(rhs);
    equations.coupling.push_back(coupling);
  }
  return equations;
}

LensResidual evaluate(const LensBundle& bundle) {
  LensResidual residual;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    const BoardView& view = bundle.views[v];
    double sum = 0.0;
    for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
      const auto corner = linearise(bundle.lens, bundle.camera_from_board[v], view.board_m[i], view.seen_px[i]);
      sum += corner ? corner->residual_px.squaredNorm() : kInvisibleResidual_px * kInvisibleResidual_px;
    }
    residual.sum_px2 += sum;
    residual.points += view.seen_px.size();
    residual.view_rms_px.push_back(std::sqrt(sum / (2.0 * static_cast<double>(view.seen_px.size()))));
  }
  return residual;
}

LensBundle apply_step(const LensBundle& bundle, const IntrinsicVector& step, const std::vector<Vector6>& boards) {
  LensBundle next = bundle;
  next.lens.fx_px += step[0];
  next.lens.fy_px += step[1];
  next.lens.cx_px += step[2];
  next.lens.cy_px += step[3];
  next.lens.distortion += step.tail<5>();
  for (std::size_t v = 0; v < boards.size(); ++v) {
    next.camera_from_board[v] = moved(bundle.camera_from_board[v], boards[v]);
  }
  return next;
}

// Solves the damped normal equations; constant parameters get a zero step.
std::pair<IntrinsicVector, std::vector<Vector6>> solve(const Equations& equations, const IntrinsicMask& parameters,
                                                       double damping) {
  IntrinsicMatrix reduced = equations.lens;
  IntrinsicVector rhs = equations.lens_rhs;
  reduced.diagonal() *= 1.0 + damping;
  for (int i = 0; i < kIntrinsicCount; ++i) reduced(i, i) += parameters[i] ? 1e-12 : 1.0;
  std::vector<Eigen::LDLT<Matrix6>> boards;
  for (std::size_t v = 0; v < equations.board.size(); ++v) {
    Matrix6 own_block = equations.board[v];
    own_block.diagonal() *= 1.0 + damping;
    own_block.diagonal().array() += 1e-12;
    boards.emplace_back(own_block);
    reduced -= equations.coupling[v] * boards[v].solve(equations.coupling[v].transpose());
    rhs -= equations.coupling[v] * boards[v].solve(equations.board_rhs[v]);
  }
  const IntrinsicVector lens = reduced.ldlt().solve(rhs);
  std::vector<Vector6> steps;
  for (std::size_t v = 0; v < boards.size(); ++v) {
    steps.emplace_back(boards[v].solve(equations.board_rhs[v] - equations.coupling[v].transpose() * lens));
  }
  return {lens, steps};
}

}  // namespace

double LensResidual::rms_px() const {
  return points > 0 ? std::sqrt(sum_px2 / (2.0 * static_cast<double>(points))) : 0.0;
}

// Source: the OpenCV documentation, "Camera Calibration and 3D Reconstruction" and "Fisheye camera model".
Eigen::Matrix<double, 2, kIntrinsicCount> pixel_jacobian(const Lens& lens, const Vector2d& ray) {
  Matrix29 jacobian = Matrix29::Zero();
  const PixelPoint pixel = geometry::distort(lens, {ray});
  jacobian(0, 0) = (pixel.v.x() - lens.cx_px) / lens.fx_px;
  jacobian(1, 1) = (pixel.v.y() - lens.cy_px) / lens.fy_px;
  jacobian(0, 2) = 1.0;
  jacobian(1, 3) = 1.0;
  const Vector2d f(lens.fx_px, lens.fy_px);
  const double r2 = ray.squaredNorm();
  if (lens.kind == LensKind::Fisheye) {
    const double r = std::sqrt(r2);
    if (r < 1e-12) return jacobian;
    const double theta = std::atan(r);
    double power = theta * theta * theta;
    for (int k = 4; k < 8; ++k, power *= theta * theta) jacobian.col(k) = f.cwiseProduct(ray) * (power / r);
    return jacobian;
  }
  const double x = ray.x();
  const double y = ray.y();
  jacobian.col(4) = f.cwiseProduct(ray) * r2;
  jacobian.col(5) = f.cwiseProduct(ray) * (r2 * r2);
  jacobian.col(6) = f.cwiseProduct(Vector2d(2.0 * x * y, r2 + 2.0 * y * y));
  jacobian.col(7) = f.cwiseProduct(Vector2d(r2 + 2.0 * x * x, 2.0 * x * y));
  jacobian.col(8) = f.cwiseProduct(ray) * (r2 * r2 * r2);
  return jacobian;
}

LensResidual adjust_lens(LensBundle& bundle, const IntrinsicMask& parameters, int max_iterations) {
  double damping = 1e-3;
  LensResidual residual = evaluate(bundle);
  for (int step = 0; step < max_iterations; ++step) {
    const Equations equations = build_equations(bundle, parameters);
    bool better = false;
    double before = residual.sum_px2;
    for (int attempt = 0; attempt < 10 && !better; ++attempt) {
      const auto [lens, boards] = solve(equations, parameters, damping);
      const LensBundle next = apply_step(bundle, lens, boards);
      const bool is_valid = lens.allFinite() && next.lens.fx_px > 1.0 && next.lens.fy_px > 1.0;
      LensResidual then = is_valid ? evaluate(next) : LensResidual{};
      better = is_valid && std::isfinite(then.sum_px2) && then.sum_px2 < before;
      damping = better ? std::max(1e-9, 0.2 * damping) : 8.0 * damping;
      if (!better) continue;
      bundle = next;
      residual = std::move(then);
    }
    if (!better || before - residual.sum_px2 < kCostTolerance * before) break;
  }
  return residual;
}

LensResidual refit_board_poses(LensBundle& bundle) { return adjust_lens(bundle, IntrinsicMask::Constant(false), 30); }

std::optional<IntrinsicMatrix> lens_covariance(const LensBundle& bundle, const IntrinsicMask& parameters) {
  const Equations equations = build_equations(bundle, parameters);
  IntrinsicMatrix reduced = equations.lens;
  for (std::size_t v = 0; v < equations.board.size(); ++v) {
    const Eigen::LDLT<Matrix6> own_block(equations.board[v]);
    reduced -= equations.coupling[v] * own_block.solve(equations.coupling[v].transpose());
  }
  // Scaled to a unit diagonal, because the parameters have different units.
  IntrinsicVector scale = IntrinsicVector::Zero();
  for (int i = 0; i < kIntrinsicCount; ++i) {
    if (!parameters[i]) continue;
    if (!(equations.lens(i, i) > 0.0)) return std::nullopt;
    scale[i] = 1.0 / std::sqrt(equations.lens(i, i));
  }
  IntrinsicMatrix scaled = scale.asDiagonal() * reduced * scale.asDiagonal();
  for (int i = 0; i < kIntrinsicCount; ++i) scaled(i, i) += parameters[i] ? 0.0 : 1.0;
  const Eigen::SelfAdjointEigenSolver<IntrinsicMatrix> eigen(scaled);
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] < kMinEigenvalue) return std::nullopt;
  const IntrinsicMatrix inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  return IntrinsicMatrix(scale.asDiagonal() * inverse * scale.asDiagonal());
}

std::optional<CameraFromWorld> estimate_board_pose(const BoardView& view, const Lens& lens) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
    const auto ray = geometry::undistort(lens, {view.seen_px[i]});
    if (!ray) continue;
    points.emplace_back(view.board_m[i].x(), view.board_m[i].y(), 0.0);
    rays.emplace_back(ray->v.x(), ray->v.y());
  }
  if (points.size() < kMinRays) return std::nullopt;
  try {
    cv::Vec3d rotation;
    cv::Vec3d translation;
    if (!cv::solvePnP(points, rays, cv::Matx33d::eye(), cv::noArray(), rotation, translation, false,
                      cv::SOLVEPNP_IPPE)) {
      return std::nullopt;
    }
    const Vector3d rodrigues(rotation[0], rotation[1], rotation[2]);
    CameraFromWorld pose;
    const double angle = rodrigues.norm();
    if (angle > 0.0) pose.rotation = Eigen::AngleAxisd(angle, rodrigues / angle).toRotationMatrix();
    pose.translation = {translation[0], translation[1], translation[2]};
    if (!pose.translation.allFinite() || pose.translation.z() < kMinDepth_m) return std::nullopt;
    return pose;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

}  // namespace mocap::calibration
