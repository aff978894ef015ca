#include "calibration/floor/stationary_markers.h"

namespace mocap::calibration {
namespace {

// Chosen by hand: several times the noise of a triangulated marker.
constexpr double kMaxMotion_m = 0.003;
constexpr double kMinDuration_s = 1.0;
constexpr std::size_t kMaxTracks = 4096;

}  // namespace

void StationaryMarkers::begin(Timestamp at) {
  now_ = at;
  ++instants_;
}

void StationaryMarkers::add(TrackId track, const Eigen::Vector3d& at_m) {
  if (tracks_.size() >= kMaxTracks && !tracks_.contains(track)) return;
  Track& entry = tracks_[track];
  if (entry.instants == 0) {
    entry.first = at_m;
    entry.from = now_;
  }
  entry.has_moved = entry.has_moved || (at_m - entry.first).norm() > kMaxMotion_m;
  entry.sum += at_m;
  ++entry.instants;
  entry.to = now_;
}

std::vector<Eigen::Vector3d> StationaryMarkers::positions() const {
  std::vector<Eigen::Vector3d> positions;
  for (const auto& [id, track] : tracks_) {
    if (track.has_moved || 2 * track.instants < instants_ || to_s(track.to - track.from) < kMinDuration_s) continue;
    positions.push_back(track.sum / static_cast<double>(track.instants));
  }
  return positions;
}

}  // namespace mocap::calibration
