#include "label/stationary_tracks.h"

#include <algorithm>

#include "model/bounds.h"

namespace mocap::label {

StillTracks::StillTracks(double radius_m) : radius_m_(radius_m) {
  now_.reserve(kMaxMarkers);
  before_.reserve(kMaxMarkers);
}

void StillTracks::update(const TrackedMarkers& tracked, Timestamp at) {
  before_.swap(now_);
  const auto by_track = [](const Rest& a, const Rest& b) { return a.track < b.track; };
  std::sort(before_.begin(), before_.end(), by_track);
  now_.clear();
  at_ = at;
  for (const TrackedMarker& marker : tracked) {
    const Eigen::Vector3d& place = marker.position.v;
    Rest rest{marker.id, at, place, place, 1.0};
    const auto found = std::lower_bound(before_.begin(), before_.end(), rest, by_track);
    if (found != before_.end() && found->track == marker.id && (place - found->from).norm() <= radius_m_) {
      rest = *found;
      if (marker.state != TrackState::Coasting) {
        rest.sum += place;
        rest.count += 1.0;
      }
    }
    now_.push_back(rest);
  }
}

}  // namespace mocap::label
