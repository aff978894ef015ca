#include "label/labelled_tracks.h"

#include <algorithm>

#include "model/bounds.h"

namespace mocap::label {

LabelledTracks::LabelledTracks() {
  by_id.reserve(kMaxMarkers);
  labelled.reserve(kMaxMarkers);
  trusted.reserve(kMaxMarkers);
}

void LabelledTracks::update(const TrackedMarkers& from, const Predictions& predictions) {
  tracked = &from;
  predicted = &predictions;
  by_id.clear();
  for (std::size_t i = 0; i < from.size(); ++i) by_id.emplace_back(from[i].id, static_cast<int>(i));
  std::sort(by_id.begin(), by_id.end());
  labelled.assign(from.size(), false);
  trusted.assign(from.size(), false);
}

int LabelledTracks::find(TrackId id) const {
  const auto found = std::lower_bound(by_id.begin(), by_id.end(), std::pair{id, 0});
  return found != by_id.end() && found->first == id ? found->second : kNone;
}

}  // namespace mocap::label
