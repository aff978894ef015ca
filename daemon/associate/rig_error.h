#pragma once

#include <cstddef>
#include <vector>

#include "base/archive.h"

namespace mocap::associate {

/// Both estimators below learn from this many markers a set, because the rig error changes slowly (chosen by hand), and
/// only from markers with at least this many views, whose residual is mostly noise.
inline constexpr std::size_t kRigErrorMarkersPerSet = 4;
inline constexpr std::size_t kMinRigErrorViews = 4;

/// Estimates the rig error of each camera: the reprojection error beyond the centroid noise of the blobs. The settings
/// give the upper bound; a well calibrated rig is far better, and a narrower gate then rejects the blobs of other
/// markers.
///
/// Uses a running median by stochastic approximation for each camera, which tolerates one wrong view in ten. Never
/// allocates after construction.
class RigError {
 public:
  /// `max_px`: initial value and upper bound; standard deviation of each axis.
  RigError(double max_px, std::size_t camera_count);

  /// Learns from one view of a point on which `views` (3 or more) agree. `error_px`: distance of the blob from the
  /// projected point. `blob_px`: standard deviation of the blob's centroid, each axis.
  void learn(std::size_t camera, double error_px, double blob_px, std::size_t views);

  /// The rig error of the worst camera with a safety factor: standard deviation of each axis.
  double px() const;

  void archive(Archive& members) { members(sigma_px_); }

 private:
  double max_px_;
  std::vector<double> sigma_px_;  // by camera
};

/// Estimates one rig error for all cameras from the residuals of points, for the covariance of triangulated points.
/// Never allocates.
class PointError {
 public:
  /// `max_px`: upper bound; standard deviation of each axis.
  explicit PointError(double max_px) : max_px_(max_px) {}

  /// Learns from one point of `views` (3 or more). `rms_px`: rms distance of the blobs from the projected point.
  /// `blob_px2`: variance of the blobs' centroids, each axis.
  void learn(double rms_px, double blob_px2, std::size_t views);

  /// Variance of each axis, without a safety factor.
  double px2() const { return sigma_px_ * sigma_px_; }

  void archive(Archive& members) { members(sigma_px_); }

 private:
  double max_px_;
  double sigma_px_ = 0.02;  // initial value for a well calibrated rig; a larger error is learned within a second
};

}  // namespace mocap::associate
