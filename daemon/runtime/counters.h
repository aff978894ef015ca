#pragma once

#include <atomic>
#include <cstdint>

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

/// Raised by one camera's thread.
struct CameraCounters {
  Counter frames;
  Counter missing_frames;      ///< gaps in the camera's own count
  Counter failed_frames;       ///< came, and were unusable
  Counter dropped_queue_full;  ///< blob frames that the fusion had no room for
  Counter dropped_blobs;       ///< over kMaxBlobs
  Counter reopened;
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
