#pragma once

#include <cstddef>
#include <vector>

namespace mocap::stages {

/// Learns how far off a rig's views are, from markers that many views agree on: calibration and blobs together.
/// Settings say how bad a rig may be; most are far better, and then a blob that is off by as much as settings allow is
/// another marker's.
///
/// Keeps a running median for each camera, so that one wrong view in ten hardly counts. Never allocates after
/// construction.
class RigError {
 public:
  /// `most_px`: what is assumed at first, and never exceeded; standard deviation of each axis.
  RigError(double most_px, std::size_t camera_count);

  /// A view's distance from the point that `views` views (3 or more) agree on.
  void learn(std::size_t camera, double error_px, std::size_t views);

  /// Standard deviation of each axis, of the worst camera; with something to spare.
  double px() const;

 private:
  double most_px_;
  std::vector<double> sigma_px_;  // by camera
};

}  // namespace mocap::stages
