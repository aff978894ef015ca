#pragma once

#include <cstddef>
#include <vector>

namespace mocap::stages {

/// Learns how far off a rig's views are beyond what their blobs promise, from markers that many views agree on.
/// Settings say how bad a rig may be; most are far better, and then a blob that is off by as much as settings allow is
/// another marker's.
///
/// Keeps a running median for each camera, so that one wrong view in ten hardly counts. Never allocates after
/// construction.
class RigError {
 public:
  /// `most_px`: what is assumed at first, and never exceeded; standard deviation of each axis.
  RigError(double most_px, std::size_t camera_count) : RigError(most_px, camera_count, most_px) {}
  /// The same, where something else is assumed at first.
  RigError(double most_px, std::size_t camera_count, double first_px);

  /// A view's distance from the point that `views` views (3 or more) agree on, and what its blob promises: standard
  /// deviation of each axis.
  void learn(std::size_t camera, double error_px, double blob_px, std::size_t views);

  /// Standard deviation of each axis, of the worst camera; with something to spare.
  double px() const;
  /// Standard deviation of each axis, of one camera; nothing to spare.
  double px(std::size_t camera) const { return sigma_px_[camera]; }

 private:
  double most_px_;
  std::vector<double> sigma_px_;  // by camera
};

}  // namespace mocap::stages
