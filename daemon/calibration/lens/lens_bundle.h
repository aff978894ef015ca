#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/lens/find_board.h"
#include "model/camera_model.h"
#include "model/transform.h"

namespace mocap::calibration {

inline constexpr int kIntrinsicCount = 9;  ///< fx fy cx cy and the five of Lens::distortion
using IntrinsicVector = Eigen::Matrix<double, kIntrinsicCount, 1>;
using IntrinsicMatrix = Eigen::Matrix<double, kIntrinsicCount, kIntrinsicCount>;

/// The intrinsic parameters that a fit estimates; the others stay constant.
using IntrinsicMask = Eigen::Array<bool, kIntrinsicCount, 1>;

/// The unknowns and the observations of an intrinsic calibration.
struct LensBundle {
  Lens lens;
  std::vector<BoardView> views;
  std::vector<CameraFromWorld> camera_from_board;  ///< by view; the world is the board
};

/// The residual of a fit.
struct LensResidual {
  double sum_px2 = 0.0;  ///< squared residuals of all corners, both axes
  std::size_t points = 0;
  std::vector<double> view_rms_px;  ///< per axis
  double rms_px() const;            ///< per axis
};

/// Derivative of the pixel of a ray by the intrinsic parameters.
Eigen::Matrix<double, 2, kIntrinsicCount> pixel_jacobian(const Lens& lens, const Eigen::Vector2d& ray);

/// Minimises the sum of squared reprojection residuals over the masked intrinsic parameters and all board poses:
/// Levenberg-Marquardt with the board poses eliminated (Schur complement).
LensResidual adjust_lens(LensBundle& bundle, const IntrinsicMask& parameters, int max_iterations);

/// As adjust_lens with constant intrinsics: only the board poses are estimated.
LensResidual refit_board_poses(LensBundle& bundle);

/// Covariance of the masked intrinsic parameters for residuals of 1 px; zero for the others. Nothing if the views do
/// not determine the parameters.
std::optional<IntrinsicMatrix> lens_covariance(const LensBundle& bundle, const IntrinsicMask& parameters);

/// The pose of a board for given intrinsics, by planar PnP. Nothing if fewer than 6 corners have a ray, or if the board
/// would be behind the camera.
///
/// Source: Collins, Bartoli, "Infinitesimal plane-based pose estimation" (2014), as implemented by OpenCV.
std::optional<CameraFromWorld> estimate_board_pose(const BoardView& view, const Lens& lens);

}  // namespace mocap::calibration
