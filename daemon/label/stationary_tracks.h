#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/time.h"
#include "model/sighting.h"

namespace mocap::label {

/// Rest periods of the 3D tracks: how long each track has been stationary, and its mean position meanwhile.
///
/// Allocates in the constructor only. One thread.
class StationaryTracks {
 public:
  /// A rest period ends when the track is farther than `radius_m` from its position at the start of the period; a new
  /// period starts there.
  explicit StationaryTracks(double radius_m);

  /// Takes over the rest periods of `before`; the radius stays.
  void adopt(StationaryTracks& before) { current_.swap(before.current_); }

  /// Takes the tracks of the set at `at`. Forgets tracks that ended. A coasting track does not change its mean.
  void update(const TrackedMarkers& tracked, Timestamp at);

  /// Age of the rest period of the i-th track of the last `update`.
  Duration rest_duration(std::size_t i) const { return at_ - current_[i].since; }
  /// World position, m, of the i-th track of the last `update`: mean over its rest period.
  Eigen::Vector3d mean(std::size_t i) const { return current_[i].sum / current_[i].count; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(at_, current_); }

 private:
  struct RestPeriod {
    TrackId track;
    Timestamp since;
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 1.0;

    void archive(Archive& members) { members(track, since, from, sum, count); }
  };

  double radius_m_;
  Timestamp at_;
  std::vector<RestPeriod> current_;   // in the order of the last update
  std::vector<RestPeriod> previous_;  // sorted by track
};

}  // namespace mocap::label
