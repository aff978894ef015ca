#pragma once

#include <span>
#include <vector>

#include "base/time.h"
#include "model/sighting.h"

namespace mocap::label {

/// Knows which tracks hold still, how long, and where on average.
///
/// Allocates in the constructor only.
class StationaryTracks {
 public:
  /// A track that goes further than `radius_m` from where its rest began moves, and may begin to rest anew.
  explicit StationaryTracks(double radius_m);

  /// What was seen at `at`. Tracks that are gone are forgotten.
  void update(const TrackedMarkers& tracked, Timestamp at);

  /// How long the i-th marker of the last update has rested; its mean place meanwhile.
  Duration rest_duration(std::size_t i) const { return at_ - current_[i].since; }
  Eigen::Vector3d mean(std::size_t i) const { return current_[i].sum / current_[i].count; }

 private:
  struct RestPeriod {
    TrackId track;
    Timestamp since;
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 1.0;
  };

  double radius_m_;
  Timestamp at_;
  std::vector<RestPeriod> current_;   // in the order of the last update
  std::vector<RestPeriod> previous_;  // by track
};

}  // namespace mocap::label
