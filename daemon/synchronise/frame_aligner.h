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

/// What became of the frames of all cameras.
struct AlignCounts {
  std::uint64_t sets = 0;      ///< given out
  std::uint64_t complete = 0;  ///< of these, with a view of every expected camera
  std::uint64_t late = 0;      ///< frames whose set had left
  std::uint64_t repeated = 0;  ///< frames not later than the one before of the same camera
  std::uint64_t overflow = 0;  ///< frames for which there was no room
};

/// How far one camera exposes from the mean of its sets; positive: later.
struct CameraSkew {
  std::uint64_t sets = 0;
  Duration sum{0};
  Duration largest{0};  ///< either way, as a magnitude

  Duration mean() const { return sets == 0 ? Duration{0} : sum / static_cast<Duration::rep>(sets); }
};

/// Gathers what the cameras saw at one instant. Reads no clock: `now` is an argument, so that a replay gives the sets
/// that the live run gave.
///
/// A set begins with the earliest frame that waits and takes in each camera's next frame of the `window` after it. It
/// is ready when every expected camera has a view in it or has already delivered something later, so that a lost image
/// costs no waiting; or when its first frame has waited `patience`, or a camera's frames have no more room. As long as
/// patience does not end, the sets depend on the frames alone and not on how the cameras' deliveries mingle.
///
/// Live, no set waits for a camera that let patience end four times in a row until a frame of it comes that a set would
/// have waited for, nor for one whose next frame is not due, since it is slower than the others or runs by itself.
///
/// One thread owns it. Nothing allocates after construction.
class FrameAligner {
 public:
  /// `camera_count` (1 to kMaxCameras) cameras are expected.
  FrameAligner(AlignSettings settings, std::size_t camera_count);

  /// Whether a frame of this camera would be kept. Who must not lose any asks before `add`.
  bool has_room(CameraId camera) const;

  /// Takes in one image's blobs. A frame that is not later than the camera's last one is dropped and counted; when
  /// that has happened for eight in a row, the camera's clock was set back and is believed again.
  void add(const BlobFrame& frame);

  /// Whether `take` would give a set.
  bool ready(Timestamp now) const;

  /// The oldest set, once it is ready at `now` (on the clock of the frames' received_at and detected_at;
  /// Timestamp::min(): patience never ends). One set a call. The views stay valid until the next `add` or `take`.
  std::optional<FrameSet> take(Timestamp now);

  /// This camera will not deliver any more: what it gave still counts, and no set waits for it.
  void finish(CameraId camera);

  /// This camera is expected again; its clock may have changed.
  void rejoin(CameraId camera);

  bool is_expected(CameraId camera) const;
  std::uint32_t expected_cameras() const;

  /// When the set that waits now would be given out for want of patience; nothing when no frame waits. A thread that
  /// sleeps wakes then.
  std::optional<Timestamp> patience_ends() const;

  const AlignCounts& counts() const { return counts_; }
  const CameraSkew& skew(CameraId camera) const;

  /// Tells anew which cameras expose together, by the frames since; about once a second.
  void assess_timing() { watch_.assess(); }
  /// As of the last `assess_timing`: also of a camera whose frames are in no set of the others.
  const CameraTiming& timing(CameraId camera) const { return watch_.timing(camera); }

 private:
  static constexpr std::size_t kPending = 8;  // frames a camera may be ahead of the slowest

  struct CameraQueue {
    std::vector<BlobFrame> ring{kPending};
    std::size_t first = 0;
    std::size_t size = 0;
    bool expected = true;
    std::size_t missed_in_row = 0;      // sets that left without it; none since a frame of it was in time
    Timestamp last = Timestamp::min();  // exposure of the last frame that was kept
    std::size_t repeated_in_row = 0;
    CameraSkew skew;

    const BlobFrame& front() const { return ring[first]; }
    void pop() {
      first = (first + 1) % kPending;
      --size;
    }
  };

  const CameraQueue& queue_of(CameraId camera) const;
  CameraQueue& queue_of(CameraId camera);
  std::optional<Timestamp> first_exposure() const;
  bool is_due(std::size_t camera, Timestamp end) const;
  bool is_in_time(const BlobFrame& frame) const;
  bool is_awaiting_nobody(Timestamp end, bool live) const;
  std::optional<Timestamp> first_arrival(Timestamp end) const;
  FrameSet gather(Timestamp end);
  void learn_skew(const FrameSet& set);

  AlignSettings settings_;
  std::vector<CameraQueue> cameras_;
  Timestamp last_set_end_ = Timestamp::min();  // frames up to here belong to sets that have left
  Duration first_delay_{0};                    // of the last set's first frame, from exposure to arrival
  AlignCounts counts_;
  ExposureWatch watch_;
};

}  // namespace mocap::synchronise
