#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "model/camera_model.h"

namespace mocap::calibration {

/// Uncertainty of triangulated markers over a volume: standard deviations (root of the sum over three axes) of points
/// that are seen by all cameras with the point in their image. A common motion of the rig as a whole does not count.
struct VolumeUncertainty {
  Eigen::Vector3d from_m;  ///< corners of the box
  Eigen::Vector3d to_m;
  int columns = 0;                ///< grid points along x
  int rows = 0;                   ///< grid points along y
  std::vector<double> heights_m;  ///< z of the horizontal slices
  /// By slice, row by row; infinite if fewer than two cameras see the point.
  std::vector<std::vector<double>> sigma_m;
  std::optional<double> median_m;  ///< over the points that two cameras or more see; nothing: there are none
  std::optional<double> p90_m;     ///< 90th percentile, of the same
  double unseen_fraction = 0.0;    ///< of the grid points
};

/// The standard deviation of a triangulated point: the noise of the observations (`sigma_px` per axis), and the
/// covariance of the rig, propagated to first order. `covariance`: as in RigCovariance, or empty. Nothing if fewer than
/// two cameras see the point, or if its standard deviation exceeds 10 m.
std::optional<double> position_sigma_m(const Rig& rig, const Eigen::MatrixXd& covariance, double sigma_px,
                                       const Eigen::Vector3d& point_m);

/// The uncertainty on a grid over the box of `points_m` (1st to 99th percentile of each axis). Nothing for fewer than
/// 10 points.
std::optional<VolumeUncertainty> volume_uncertainty(const std::vector<Eigen::Vector3d>& points_m, const Rig& rig,
                                                    const Eigen::MatrixXd& covariance, double sigma_px);

}  // namespace mocap::calibration
