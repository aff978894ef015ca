#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "base/time.h"
#include "model/bounds.h"
#include "module/blob_tracker.h"

namespace mocap::track2d {

enum class TrackMethod { AlphaBeta, AdaptiveAlphaBeta, Kalman, Condensation };

/// Following blobs in one camera's images; the settings of all methods.
struct TrackBlobsSettings {
  TrackMethod method = TrackMethod::Kalman;
  double gate_sigmas = 4.0;          ///< 1 to 10; a blob further from where it should be is another marker
  double gate_floor_px = 2.0;        ///< standard deviation that the gate has at least, 0 to 100
  double gate_per_speed = 0.5;       ///< the same, for each px that the marker is expected to move, 0 to 2
  double gate_growth_px_s = 300.0;   ///< by which it reaches further while the marker is not seen (kalman), 0 to 10000
  std::uint32_t confirm_images = 3;  ///< consecutive images until a track is believed, 1 to 100
  Duration max_coast = std::chrono::milliseconds(1500);  ///< unseen for longer, a track ends
  double acceleration_px_s2 = 4000.0;                    ///< standard deviation of what changes the motion
  double birth_speed_px_s = 400.0;                       ///< standard deviation of a new marker's velocity
  double alpha = 0.9;                                    ///< alpha-beta: share that moves the point, 0 to 1
  double beta = 0.8;                                     ///< alpha-beta: share that changes the velocity, 0 to 2
  double alpha_beta_gate_px = 10.0;  ///< alpha-beta: standard deviation of its fixed gate, 0.1 to 100
  int particles = 100;               ///< CONDENSATION: 2 to 256
  std::uint64_t seed = 1;            ///< CONDENSATION
};

/// Makes the tracker of one camera, for images of `max_blobs` at most: each blob's `track` names the confirmed track
/// that it belongs to; the blobs of tentative tracks stay without, and so do those of markers that cannot be told apart
/// for a while (BlobPair). The assignment is the best in sum over all tracks
/// and blobs within their gates. Settings are in their ranges. `track` does not allocate. It implements
/// BlobTrackInspection too.
std::unique_ptr<BlobTracker> make_blob_tracker(const TrackBlobsSettings& settings, std::size_t max_blobs = kMaxBlobs);

}  // namespace mocap::track2d
