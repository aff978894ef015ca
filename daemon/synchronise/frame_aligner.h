#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/time.h"
#include "model/blob.h"
#include "model/bounds.h"
#include "model/sighting.h"
#include "synchronise/align_settings.h"
#include "synchronise/exposure_watch.h"

namespace mocap::synchronise {

/// Counts of the frames of all cameras, and of the sets made of them.
struct AlignCounts {
  std::uint64_t sets = 0;      ///< sets that take() returned
  std::uint64_t complete = 0;  ///< sets with a frame of every expected camera
  std::uint64_t late = 0;      ///< frames that arrived after their set was returned
  std::uint64_t repeated = 0;  ///< frames that were exposed no later than the camera's previous frame
  std::uint64_t overflow = 0;  ///< frames dropped because the camera's queue was full
  std::uint64_t cleared = 0;   ///< frames that waited when their camera was started again or its clock was set back
};

/// Offset of one camera's exposures from the mean exposure of its sets; positive: later than the mean.
struct CameraSkew {
  std::uint64_t sets = 0;
  Duration sum{0};
  Duration largest{0};  ///< largest magnitude

  Duration mean() const { return sets == 0 ? Duration{0} : sum / static_cast<Duration::rep>(sets); }
};

/// The mean of the exposures of a set, which has at least one view.
Timestamp mean_exposure(const FrameSet& set);

/// Groups the frames that were exposed at one instant. Reads no clock: `now` is an argument, so that a replay gives the
/// same sets as the live run.
///
/// A set starts with the earliest waiting frame, and contains each camera's next frame that was exposed at most
/// `window` later. A set is ready when every expected camera has a frame in the set or has already delivered a later
/// frame: a lost image causes no waiting. A set is also ready when its first frame has waited `patience`, or when a
/// camera's queue is full. Unless patience runs out, the sets depend on the frames alone, not on the order of arrival
/// across cameras.
///
/// In a live run, a set does not wait for two kinds of cameras: a camera that let patience run out for four sets in a
/// row (until one of its frames arrives in time again), and a camera whose next frame is not due yet because its rate
/// is lower or its exposures are not synchronised.
///
/// Thread: one. Never allocates after construction.
class FrameAligner {
 public:
  /// A complete set has frames of `camera_count` (1 to kMaxCameras) cameras.
  FrameAligner(AlignSettings settings, std::size_t camera_count);

  /// Numbers the sets on from those of `before`, and returns no set that was exposed before them.
  void continue_after(const FrameAligner& before) {
    counts_ = before.counts_;
    last_set_end_ = before.last_set_end_;
  }

  /// Whether `add` would keep a frame of this camera. A replay, which must not lose frames, asks before `add`.
  bool has_room(CameraId camera) const;

  /// Adds one camera's blobs. A frame that was exposed no later than the camera's previous frame is dropped and
  /// counted. After eight such frames in a row the camera's clock must have been set back, and the new time is
  /// accepted.
  void add(const BlobFrame& frame);

  /// Whether `take` would return a set.
  bool ready(Timestamp now) const;

  /// Returns the oldest set if the set is ready at `now`, one set a call. `now` is on the clock of the frames'
  /// received_at and detected_at; with Timestamp::min() patience never runs out. The frames stay valid until the next
  /// `add` or `take`.
  std::optional<FrameSet> take(Timestamp now);

  /// Whether nothing is lost if a set that was taken is passed over: each camera of the set has a newer frame, and the
  /// set of the earliest of these frames is ready. A set of other cameras alone supersedes nothing.
  bool is_superseded(const FrameSet& set, Timestamp now) const;

  /// Declares that this camera delivers no more frames. Its waiting frames are still used; no set waits for the camera.
  void finish(CameraId camera);

  /// Declares that this camera delivers again. The camera's clock may have changed.
  void rejoin(CameraId camera);

  bool is_expected(CameraId camera) const;
  std::uint32_t expected_cameras() const;

  /// The time at which the waiting set runs out of patience; empty if no frame waits. A sleeping thread wakes at that
  /// time.
  std::optional<Timestamp> patience_ends() const;

  const AlignCounts& counts() const { return counts_; }
  const CameraSkew& skew(CameraId camera) const;

  /// Assesses which cameras expose together, from the frames since the last call. Call about once a second.
  void assess_timing() { watch_.assess(); }
  /// The result of the last `assess_timing`, also for a camera whose frames share no set with other cameras.
  const CameraTiming& timing(CameraId camera) const { return watch_.timing(camera); }

 private:
  static constexpr std::size_t kPending = 8;  // frames by which a camera may be ahead of the slowest camera

  struct CameraQueue {
    std::vector<BlobFrame> ring{kPending};
    std::size_t first = 0;
    std::size_t size = 0;
    bool expected = true;
    std::size_t missed_in_row = 0;      // consecutive sets that were returned without this camera's frame
    Timestamp last = Timestamp::min();  // exposure of the last kept frame
    std::size_t repeated_in_row = 0;
    CameraSkew skew;

    const BlobFrame& front() const { return ring[first]; }
    void pop() {
      first = (first + 1) % kPending;
      --size;
    }
  };

  void clear(CameraQueue& queue);
  const CameraQueue& queue_of(CameraId camera) const;
  CameraQueue& queue_of(CameraId camera);
  std::optional<Timestamp> first_exposure() const;
  bool is_due(std::size_t camera, Timestamp end) const;
  bool is_in_time(const BlobFrame& frame) const;
  bool is_ready_from(Timestamp first, Timestamp now) const;
  bool is_awaiting_nobody(Timestamp first, Timestamp end, bool live) const;
  std::optional<Timestamp> first_arrival(Timestamp end) const;
  FrameSet gather(Timestamp end);
  void learn_skew(const FrameSet& set);

  AlignSettings settings_;
  std::vector<CameraQueue> cameras_;
  Timestamp last_set_end_ =
      Timestamp::min();      // frames exposed up to this time belong to sets that were already returned
  Duration first_delay_{0};  // from exposure to arrival, first frame of the last set
  AlignCounts counts_;
  ExposureWatch watch_;
};

}  // namespace mocap::synchronise
