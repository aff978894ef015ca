#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/time.h"
#include "model/blob.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap::track2d {

enum class BlobTrackState {
  Tentative,  ///< not yet confirmed
  Confirmed,  ///< measured in the last frame
  Coasting,   ///< confirmed, not measured in the last frame
  Lost,       ///< deleted in the last frame
};

/// State of one track of a blob tracker.
struct BlobTrackBelief {
  static constexpr std::uint32_t kUnseen = 0xFFFF'FFFF;

  BlobTrackId track;
  bool confirmed = false;
  PixelPoint point;              ///< predicted position
  double gate_radius_px = 0.0;   ///< radius of a circle with the area of the gate, for a blob without noise
  std::uint32_t blob = kUnseen;  ///< index in the last frame; two tracks that share a merged blob both have its index
  BlobTrackState state = BlobTrackState::Confirmed;
  bool sure = true;  ///< unambiguous; an ambiguous track's id is not written to the blob
};

/// The internal state of a blob tracker, for evaluation and plots; the daemon does not use this interface. The trackers
/// of this folder implement it beside BlobTracker.
class BlobTrackInspection {
 public:
  virtual ~BlobTrackInspection() = default;

  /// Appends the prediction of each track at `at`, including tentative tracks and those deleted in the last frame. `at`
  /// is no earlier than the last frame.
  virtual void predict_tracks(Timestamp at, std::vector<BlobTrackBelief>& into) const = 0;

  /// As BlobTracker::track, without the daemon's bound on the blobs of an image: for measurements of cost.
  virtual void track_all(Timestamp at, std::span<Blob> blobs) = 0;
};

}  // namespace mocap::track2d
