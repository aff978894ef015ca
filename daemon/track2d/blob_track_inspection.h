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
  Tentative,  ///< seen too few times to be believed
  Confirmed,  ///< seen in the last frame
  Coasting,   ///< believed, not seen in the last frame
  Lost,       ///< unseen for too long: it ended in the last frame
};

/// What a tracker of blobs holds for true about one of its tracks.
struct BlobTrackBelief {
  static constexpr std::uint32_t kUnseen = 0xFFFF'FFFF;

  BlobTrackId track;
  bool confirmed = false;
  PixelPoint point;              ///< where it should be
  double gate_radius_px = 0.0;   ///< of a circle of the gate's area, for a well-known blob
  std::uint32_t blob = kUnseen;  ///< index in the last frame; of a blob that two markers share both tracks have it
  BlobTrackState state = BlobTrackState::Confirmed;
  bool sure = true;  ///< that the blob is its own: else the frame does not bear its name
};

/// What a tracker thinks, beside what it says: for those who judge or draw trackers, not for the daemon. The trackers
/// of this room implement it beside BlobTracker.
class BlobTrackInspection {
 public:
  virtual ~BlobTrackInspection() = default;

  /// Appends each track, tentative and just lost ones too, as it will be expected at `at`; changes nothing. `at` is
  /// that of the last frame or later.
  virtual void predict_tracks(Timestamp at, std::vector<BlobTrackBelief>& into) const = 0;

  /// As BlobTracker::track, for as many blobs as the tracker was made for: more than an image of the daemon has, where
  /// costs are measured.
  virtual void track_all(Timestamp at, std::span<Blob> blobs) = 0;
};

}  // namespace mocap::track2d
