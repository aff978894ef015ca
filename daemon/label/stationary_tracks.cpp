#include "label/stationary_tracks.h"

#include <algorithm>

#include "model/bounds.h"

namespace mocap::label {

StationaryTracks::StationaryTracks(double radius_m) : radius_m_(radius_m) {
  current_.reserve(kMaxMarkers);
  previous_.reserve(kMaxMarkers);
}

void StationaryTracks::update(const TrackedMarkers& tracked, Timestamp at) {
  previous_.swap(current_);
  const auto by_track = [](const RestPeriod& a, const RestPeriod& b) { return a.track < b.track; };
  std::sort(previous_.begin(), previous_.end(), by_track);
  current_.clear();
  at_ = at;
  for (const TrackedMarker& marker : tracked) {
    const Eigen::Vector3d& place = marker.position.v;
    RestPeriod rest{marker.id, at, place, place, 1.0};
    const auto found = std::lower_bound(previous_.begin(), previous_.end(), rest, by_track);
    if (found != previous_.end() && found->track == marker.id && (place - found->from).norm() <= radius_m_) {
      rest = *found;
      if (marker.state != TrackState::Coasting) {
        rest.sum += place;
        rest.count += 1.0;
      }
    }
    current_.push_back(rest);
  }
}

}  // namespace mocap::label
