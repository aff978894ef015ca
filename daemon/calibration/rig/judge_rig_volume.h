#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "model/camera_model.h"

namespace mocap::calibration {

/// How well markers can be located over a volume: standard deviations (root of the sum over three axes) of a point that
/// all cameras see who have it in their image. What the rig as a whole is moved or turned by does not count.
struct VolumeUncertainty {
  Eigen::Vector3d from_m;  ///< corners of the box
  Eigen::Vector3d to_m;
  int columns = 0;                ///< along x
  int rows = 0;                   ///< along y
  std::vector<double> heights_m;  ///< of the slices
  /// By slice, row by row; infinite where two cameras do not see the point.
  std::vector<std::vector<double>> sigma_m;
  double median_m = 0.0;  ///< of the points that are seen
  double p90_m = 0.0;
  double unseen_share = 0.0;
};

/// The standard deviation of one point: by the noise of the sights, and by what the rig may be wrong. `covariance` as
/// RigDoubt has it, or empty. Nothing where two cameras do not see it.
std::optional<double> position_sigma_m(const Rig& rig, const Eigen::MatrixXd& covariance, double sigma_px,
                                       const Eigen::Vector3d& point_m);

/// Over the box that holds most of `points_m`. Nothing for fewer than 10 points.
std::optional<VolumeUncertainty> uncertainty_over(const std::vector<Eigen::Vector3d>& points_m, const Rig& rig,
                                                  const Eigen::MatrixXd& covariance, double sigma_px);

}  // namespace mocap::calibration
