#include "label/labelled_tracks.h"

#include <algorithm>

#include "model/bounds.h"

namespace mocap::label {

NamedTracks::NamedTracks() {
  by_id.reserve(kMaxMarkers);
  named.reserve(kMaxMarkers);
  sure.reserve(kMaxMarkers);
}

void NamedTracks::take(const TrackedMarkers& from) {
  tracked = &from;
  by_id.clear();
  for (std::size_t i = 0; i < from.size(); ++i) by_id.emplace_back(from[i].id, static_cast<int>(i));
  std::sort(by_id.begin(), by_id.end());
  named.assign(from.size(), false);
  sure.assign(from.size(), false);
}

int NamedTracks::find(TrackId id) const {
  const auto found = std::lower_bound(by_id.begin(), by_id.end(), std::pair{id, 0});
  return found != by_id.end() && found->first == id ? found->second : kNone;
}

}  // namespace mocap::label
