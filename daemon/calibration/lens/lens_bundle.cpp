#include "calibration/lens/lens_bundle.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Matrix29 = Eigen::Matrix<double, 2, kLensParts>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix96 = Eigen::Matrix<double, kLensParts, 6>;

constexpr double kNearest_m = 0.01;
constexpr std::size_t kLeastRays = 6;
constexpr double kSettled = 1e-11;  // share of the cost
// A residual of a corner that the lens cannot have seen, px: large, but no reason to give everything up.
constexpr double kUnseen_px = 1e3;

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

CameraFromWorld moved(const CameraFromWorld& pose, const Vector6& step) {
  const double angle = step.head<3>().norm();
  const Matrix3d turn = angle > 0.0 ? Eigen::AngleAxisd(angle, step.head<3>() / angle).toRotationMatrix()
                                    : Matrix3d(Matrix3d::Identity());
  return {turn * pose.rotation, pose.translation + step.tail<3>()};
}

// How one corner's pixel moves with lens and board, and how far off it is.
struct Corner {
  Vector2d residual_px;  // seen minus projected
  Matrix29 by_lens;
  Matrix26 by_board;  // turn (about the camera's axes, at the board's place), shift
};

std::optional<Corner> look(const Lens& lens, const CameraFromWorld& pose, const Vector2d& on_board,
                           const Vector2d& seen) {
  const Vector3d turned = pose.rotation * Vector3d(on_board.x(), on_board.y(), 0.0);
  const Vector3d at = turned + pose.translation;
  if (at.z() < kNearest_m) return std::nullopt;
  const Vector2d ray = at.head<2>() / at.z();
  const geometry::DistortedRay distorted = geometry::distort_with_slope(lens, {ray});
  Eigen::Matrix<double, 2, 3> ray_by_point;
  ray_by_point << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  const Eigen::Matrix<double, 2, 3> by_point = distorted.px_from_ray * ray_by_point / at.z();
  Corner corner;
  corner.residual_px = seen - distorted.pixel.v;
  corner.by_lens = pixel_by_lens(lens, ray);
  corner.by_board << -by_point * cross(turned), by_point;
  return corner;
}

// The normal equations, board by board.
struct Equations {
  LensMatrix lens = LensMatrix::Zero();
  LensVector lens_rhs = LensVector::Zero();
  std::vector<Matrix6> board;
  std::vector<Vector6> board_rhs;
  std::vector<Matrix96> between;
};

Equations gather(const LensBundle& bundle, const LensParts& parts) {
  Equations equations;
  const LensVector used = parts.cast<double>();
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    Matrix6 board = Matrix6::Zero();
    Vector6 rhs = Vector6::Zero();
    Matrix96 between = Matrix96::Zero();
    const BoardView& view = bundle.views[v];
    for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
      const auto corner = look(bundle.lens, bundle.camera_from_board[v], view.board_m[i], view.seen_px[i]);
      if (!corner) continue;
      const Matrix29 by_lens = corner->by_lens * used.asDiagonal();
      equations.lens += by_lens.transpose() * by_lens;
      equations.lens_rhs += by_lens.transpose() * corner->residual_px;
      board += corner->by_board.transpose() * corner->by_board;
      rhs += corner->by_board.transpose() * corner->residual_px;
      between += by_lens.transpose() * corner->by_board;
    }
    equations.board.push_back(board);
    equations.board_rhs.push_back(rhs);
    equations.between.push_back(between);
  }
  return equations;
}

LensResidue residue_of(const LensBundle& bundle) {
  LensResidue residue;
  for (std::size_t v = 0; v < bundle.views.size(); ++v) {
    const BoardView& view = bundle.views[v];
    double sum = 0.0;
    for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
      const auto corner = look(bundle.lens, bundle.camera_from_board[v], view.board_m[i], view.seen_px[i]);
      sum += corner ? corner->residual_px.squaredNorm() : kUnseen_px * kUnseen_px;
    }
    residue.sum_px2 += sum;
    residue.points += view.seen_px.size();
    residue.view_rms_px.push_back(std::sqrt(sum / (2.0 * static_cast<double>(view.seen_px.size()))));
  }
  return residue;
}

LensBundle stepped(const LensBundle& bundle, const LensVector& step, const std::vector<Vector6>& boards) {
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

// Solves the damped equations; parts that are not looked for do not move.
std::pair<LensVector, std::vector<Vector6>> solve(const Equations& equations, const LensParts& parts, double damping) {
  LensMatrix reduced = equations.lens;
  LensVector rhs = equations.lens_rhs;
  reduced.diagonal() *= 1.0 + damping;
  for (int i = 0; i < kLensParts; ++i) reduced(i, i) += parts[i] ? 1e-12 : 1.0;
  std::vector<Eigen::LDLT<Matrix6>> boards;
  for (std::size_t v = 0; v < equations.board.size(); ++v) {
    Matrix6 own = equations.board[v];
    own.diagonal() *= 1.0 + damping;
    own.diagonal().array() += 1e-12;
    boards.emplace_back(own);
    reduced -= equations.between[v] * boards[v].solve(equations.between[v].transpose());
    rhs -= equations.between[v] * boards[v].solve(equations.board_rhs[v]);
  }
  const LensVector lens = reduced.ldlt().solve(rhs);
  std::vector<Vector6> steps;
  for (std::size_t v = 0; v < boards.size(); ++v) {
    steps.emplace_back(boards[v].solve(equations.board_rhs[v] - equations.between[v].transpose() * lens));
  }
  return {lens, steps};
}

}  // namespace

double LensResidue::rms_px() const {
  return points > 0 ? std::sqrt(sum_px2 / (2.0 * static_cast<double>(points))) : 0.0;
}

// Source: the OpenCV documentation, "Camera Calibration and 3D Reconstruction" and "Fisheye camera model".
Eigen::Matrix<double, 2, kLensParts> pixel_by_lens(const Lens& lens, const Vector2d& ray) {
  Matrix29 by = Matrix29::Zero();
  const PixelPoint pixel = geometry::distort(lens, {ray});
  by(0, 0) = (pixel.v.x() - lens.cx_px) / lens.fx_px;
  by(1, 1) = (pixel.v.y() - lens.cy_px) / lens.fy_px;
  by(0, 2) = 1.0;
  by(1, 3) = 1.0;
  const Vector2d f(lens.fx_px, lens.fy_px);
  const double r2 = ray.squaredNorm();
  if (lens.kind == LensKind::Fisheye) {
    const double r = std::sqrt(r2);
    if (r < 1e-12) return by;
    const double theta = std::atan(r);
    double power = theta * theta * theta;
    for (int k = 4; k < 8; ++k, power *= theta * theta) by.col(k) = f.cwiseProduct(ray) * (power / r);
    return by;
  }
  const double x = ray.x();
  const double y = ray.y();
  by.col(4) = f.cwiseProduct(ray) * r2;
  by.col(5) = f.cwiseProduct(ray) * (r2 * r2);
  by.col(6) = f.cwiseProduct(Vector2d(2.0 * x * y, r2 + 2.0 * y * y));
  by.col(7) = f.cwiseProduct(Vector2d(r2 + 2.0 * x * x, 2.0 * x * y));
  by.col(8) = f.cwiseProduct(ray) * (r2 * r2 * r2);
  return by;
}

LensResidue adjust_lens(LensBundle& bundle, const LensParts& parts, int most_steps) {
  double damping = 1e-3;
  LensResidue residue = residue_of(bundle);
  for (int step = 0; step < most_steps; ++step) {
    const Equations equations = gather(bundle, parts);
    bool better = false;
    double before = residue.sum_px2;
    for (int attempt = 0; attempt < 10 && !better; ++attempt) {
      const auto [lens, boards] = solve(equations, parts, damping);
      const LensBundle next = stepped(bundle, lens, boards);
      const bool sane = lens.allFinite() && next.lens.fx_px > 1.0 && next.lens.fy_px > 1.0;
      LensResidue then = sane ? residue_of(next) : LensResidue{};
      better = sane && std::isfinite(then.sum_px2) && then.sum_px2 < before;
      damping = better ? std::max(1e-9, 0.2 * damping) : 8.0 * damping;
      if (!better) continue;
      bundle = next;
      residue = std::move(then);
    }
    if (!better || before - residue.sum_px2 < kSettled * before) break;
  }
  return residue;
}

LensResidue place_boards(LensBundle& bundle) { return adjust_lens(bundle, LensParts::Constant(false), 30); }

std::optional<LensMatrix> lens_covariance(const LensBundle& bundle, const LensParts& parts) {
  constexpr double kLeastCurvature = 1e-13;
  const Equations equations = gather(bundle, parts);
  LensMatrix reduced = equations.lens;
  for (std::size_t v = 0; v < equations.board.size(); ++v) {
    const Eigen::LDLT<Matrix6> own(equations.board[v]);
    reduced -= equations.between[v] * own.solve(equations.between[v].transpose());
  }
  // Scaled, since px and numbers without a unit stand side by side.
  LensVector scale = LensVector::Zero();
  for (int i = 0; i < kLensParts; ++i) {
    if (!parts[i]) continue;
    if (!(equations.lens(i, i) > 0.0)) return std::nullopt;
    scale[i] = 1.0 / std::sqrt(equations.lens(i, i));
  }
  LensMatrix scaled = scale.asDiagonal() * reduced * scale.asDiagonal();
  for (int i = 0; i < kLensParts; ++i) scaled(i, i) += parts[i] ? 0.0 : 1.0;
  const Eigen::SelfAdjointEigenSolver<LensMatrix> eigen(scaled);
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()[0] < kLeastCurvature) return std::nullopt;
  const LensMatrix inverse =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose();
  return LensMatrix(scale.asDiagonal() * inverse * scale.asDiagonal());
}

std::optional<CameraFromWorld> place_board(const BoardView& view, const Lens& lens) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (std::size_t i = 0; i < view.seen_px.size(); ++i) {
    const auto ray = geometry::undistort(lens, {view.seen_px[i]});
    if (!ray) continue;
    points.emplace_back(view.board_m[i].x(), view.board_m[i].y(), 0.0);
    rays.emplace_back(ray->v.x(), ray->v.y());
  }
  if (points.size() < kLeastRays) return std::nullopt;
  try {
    cv::Vec3d turn;
    cv::Vec3d shift;
    if (!cv::solvePnP(points, rays, cv::Matx33d::eye(), cv::noArray(), turn, shift, false, cv::SOLVEPNP_IPPE)) {
      return std::nullopt;
    }
    const Vector3d rodrigues(turn[0], turn[1], turn[2]);
    CameraFromWorld pose;
    const double angle = rodrigues.norm();
    if (angle > 0.0) pose.rotation = Eigen::AngleAxisd(angle, rodrigues / angle).toRotationMatrix();
    pose.translation = {shift[0], shift[1], shift[2]};
    if (!pose.translation.allFinite() || pose.translation.z() < kNearest_m) return std::nullopt;
    return pose;
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

}  // namespace mocap::calibration
