#pragma once

#include <atomic>
#include <cstdint>

#include "model/detection_counts.h"
#include "module/detector.h"

namespace mocap::runtime {

/// A count that one thread raises and any thread reads.
class Counter {
 public:
  void add(std::uint64_t more = 1) noexcept {
    value_.store(value_.load(std::memory_order_relaxed) + more, std::memory_order_relaxed);
  }
  std::uint64_t read() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

/// A figure that one thread sets and any thread reads.
class Gauge {
 public:
  void set(double value) noexcept { value_.store(value, std::memory_order_relaxed); }
  double read() const noexcept { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<double> value_{0.0};
};

/// What one camera's detector found and left out, as DetectionCounts and DetectionLevels; raised by its thread.
struct DetectionCounters {
  Counter blobs, too_small, too_large, not_round, too_dim, dropped, rows_given_up;
  Gauge threshold_grey, noise_grey, background_grey;

  void add(const Detection& detection) noexcept;
  DetectionCounts counts() const noexcept;
  DetectionLevels levels() const noexcept;
};

/// Raised by one camera's thread.
struct CameraCounters {
  Counter frames;
  Counter missing_frames;       ///< gaps in the camera's own count
  Counter failed_frames;        ///< came, and were unusable
  Counter dropped_queue_full;   ///< blob frames that the fusion had no room for
  Counter dropped_record_full;  ///< blob frames that the recording had no room for
  DetectionCounters detection;
  Counter reopened;
};

/// How a camera stands against what the rig says (drift::CameraDrift); set by the fusion thread.
struct RigGauges {
  Gauge drifted;  ///< 1: it stands otherwise
  Gauge off_px, turned_rad, moved_m;
};

/// Raised by the fusion thread.
struct FusionCounters {
  Counter beats;  ///< rounds of the loop: it lives
  Counter sets;
  Counter complete_sets;
  Counter passed_over_sets;
  Counter dropped_publish_full;
  Counter dropped_side_full;
  Counter dropped_fits;  ///< the publish thread will not know of a subject's fit
};

/// Raised by the publish thread.
struct PublishCounters {
  Counter beats;
  Counter sent;
  Counter passed_over;
  Counter failed;
};

/// Raised by the side thread.
struct SideCounters {
  Counter beats;
  Counter written;
  Counter failed;
};

}  // namespace mocap::runtime
