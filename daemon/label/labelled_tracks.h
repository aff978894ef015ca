#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "model/predictions.h"
#include "model/sighting.h"

namespace mocap::label {

/// Standard deviation of a marker's position about its place on the bone: skin and suit. Chosen by hand; not yet
/// measured.
inline constexpr double kMarkerSigma_m = 0.004;
/// A tentative track that fewer cameras see may be clutter: two rays may intersect by chance. Chosen by hand; not yet
/// measured.
inline constexpr std::uint32_t kMinTentativeCameras = 3;

/// The 3D tracks of one frame set, and which of them have a label. Shared by the labellers of all subjects, one of
/// which at a time writes it. Allocates in the constructor only.
struct LabelledTracks {
  static constexpr int kNone = -1;

  const TrackedMarkers* tracked = nullptr;     ///< borrowed until the next `update`
  const Predictions* predicted = nullptr;      ///< the predictions that `tracked` refers to, borrowed likewise
  std::vector<std::pair<TrackId, int>> by_id;  ///< sorted by id; index into `tracked`
  std::vector<bool> labelled;                  ///< by index into `tracked`: has a label of some subject
  std::vector<bool> trusted;                   ///< likewise: the label is accepted by the pose of its body

  LabelledTracks();
  /// Takes the tracks of a new set; no track has a label. `from` and `predictions` outlive the use of this object in
  /// the set.
  void update(const TrackedMarkers& from, const Predictions& predictions);
  /// Index of a track; kNone if the track has ended.
  int find(TrackId id) const;
  /// The label of the prediction that the track's measurement was associated with; names nothing if there is none.
  Label predicted_label(std::size_t index) const {
    const std::uint32_t prediction = (*tracked)[index].prediction;
    return prediction == Match::kNew ? Label{} : predicted->markers[prediction].label;
  }
  const TrackedMarker& operator[](int index) const { return (*tracked)[static_cast<std::size_t>(index)]; }
};

}  // namespace mocap::label
