#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <vector>

#include "base/time.h"
#include "model/ids.h"

namespace mocap::calibration {

/// Finds the markers that do not move, from the tracks of a sequence of instants. Keeps at most 4096 tracks.
class StationaryMarkers {
 public:
  /// Begins the next instant.
  void begin(Timestamp at);

  /// Adds a marker of the instant, m.
  void add(TrackId track, const Eigen::Vector3d& at_m);

  /// The mean positions of the markers that stay within 3 mm for at least half of the instants and one second.
  std::vector<Eigen::Vector3d> positions() const;

 private:
  struct Track {
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t instants = 0;
    Timestamp from, to;
    bool has_moved = false;
  };

  std::map<TrackId, Track> tracks_;
  std::size_t instants_ = 0;
  Timestamp now_;
};

}  // namespace mocap::calibration
