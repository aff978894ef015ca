#pragma once

#include <atomic>
#include <cstdint>

#include "model/blob_use.h"
#include "model/detection_counts.h"
#include "module/detector.h"

namespace mocap::runtime {

/// A counter that one thread increments and any thread reads.
class Counter {
 public:
  void add(std::uint64_t more = 1) noexcept {
    value_.store(value_.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
  }
  std::uint64_t read() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

/// A value that one thread sets and any thread reads.
class Gauge {
 public:
  void set(double value) noexcept { value_.store(value, std::memory_order_relaxed); }
  double read() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<double> value_{0.0};
};

/// Counters of one camera's detector, as DetectionCounts and DetectionLevels. The camera's thread writes them.
struct DetectionCounters {
  Counter blobs, too_small, too_large, not_round, too_dim, dropped, rows_given_up;
  Gauge threshold_grey, noise_grey, background_grey, brightest_grey;

  void add(const Detection& detection) noexcept;
  DetectionCounts counts() const noexcept;
  DetectionLevels levels() const noexcept;
};

/// Counters of one camera. The camera's thread writes them.
struct CameraCounters {
  Counter frames;
  Counter missing_frames;            ///< images missing in the camera's frame numbers
  Counter failed_frames;             ///< images that arrived incomplete or were refused
  Counter dropped_queue_full;        ///< blob frames dropped because the queue to the fusion was full
  Counter dropped_record_full;       ///< blob frames dropped because the queue to the blob recorder was full
  Counter dropped_take_full;         ///< blob frames dropped because the queue to the recorder of takes was full
  Counter dropped_calibration_full;  ///< images dropped because the queue to the calibration was full
  DetectionCounters detection;
  Counter reopened;
};

/// Counters of one camera's blobs, as BlobUse. The fusion thread writes them.
struct BlobUseCounters {
  Counter blobs, in_markers;

  void add(const BlobUse& use) noexcept {
    blobs.add(use.blobs);
    in_markers.add(use.in_markers);
  }
  BlobUse read() const noexcept { return {blobs.read(), in_markers.read()}; }
};

/// Deviation of a camera's pose from the rig (drift::CameraDrift). The fusion thread writes it.
struct RigGauges {
  Gauge drifted;  ///< 1: the pose deviates from the rig
  Gauge off_px, turned_rad, moved_m;
};

/// Counters of the fusion thread.
struct FusionCounters {
  Counter beats;  ///< iterations of the loop, for the watchdog
  Counter sets;
  Counter complete_sets;
  Counter passed_over_sets;
  Counter dropped_publish_full;
  Counter dropped_side_full;
  Counter dropped_take_full;
  Counter dropped_fits;  ///< fits of subjects that the publish or side thread did not receive
};

/// Counters of the publish thread.
struct PublishCounters {
  Counter beats;
  Counter sent;
  Counter passed_over;
  Counter failed;
};

/// Counters of the side thread.
struct SideCounters {
  Counter beats;
  Counter written;
  Counter failed;
};

}  // namespace mocap::runtime
