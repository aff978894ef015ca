#pragma once

#include <utility>
#include <vector>

#include "model/sighting.h"

namespace mocap::label {

/// The tracks of one instant, and who bears which.
struct LabelledTracks {
  static constexpr int kNone = -1;

  const TrackedMarkers* tracked = nullptr;
  std::vector<std::pair<TrackId, int>> by_id;  ///< sorted; index in `tracked`
  std::vector<bool> labelled;                  ///< by index in `tracked`
  std::vector<bool> trusted;                   ///< likewise: and is where the body that bears it is expected

  LabelledTracks();
  void update(const TrackedMarkers& from);
  int find(TrackId id) const;
  const TrackedMarker& operator[](int index) const { return (*tracked)[static_cast<std::size_t>(index)]; }
};

}  // namespace mocap::label
