#pragma once

#include <cstddef>
#include <vector>

namespace mocap::associate {

/// Learns how far off a rig's views are beyond what their blobs promise, from markers that many views agree on.
/// Settings say how bad a rig may be; most are far better, and then a blob that is off by as much as settings allow is
/// another marker's.
///
/// Keeps a running median for each camera, so that one wrong view in ten hardly counts. Never allocates after
/// construction.
class RigError {
 public:
  /// `max_px`: what is assumed at first, and never exceeded; standard deviation of each axis.
  RigError(double max_px, std::size_t camera_count);

  /// A view's distance from the point that `views` views (3 or more) agree on, and what its blob promises: standard
  /// deviation of each axis.
  void learn(std::size_t camera, double error_px, double blob_px, std::size_t views);

  /// Standard deviation of each axis, of the worst camera; with something to spare.
  double px() const;

 private:
  double max_px_;
  std::vector<double> sigma_px_;  // by camera
};

/// Learns the same of all cameras together, from the points alone: what their covariance must hold beyond what the
/// blobs promise. Never allocates.
class PointError {
 public:
  /// `max_px`: never exceeded; standard deviation of each axis.
  explicit PointError(double max_px) : max_px_(max_px) {}

  /// Of a point of `views` views (3 or more): the root of their mean squared distance from it, and the variance of
  /// their blobs, each axis.
  void learn(double rms_px, double blob_px2, std::size_t views);

  /// Variance of each axis; nothing to spare.
  double px2() const { return sigma_px_ * sigma_px_; }

 private:
  double max_px_;
  double sigma_px_ = 0.02;  // a rig that is worse shows it within a second
};

}  // namespace mocap::associate
