#pragma once

#include <atomic>
#include <chrono>
#include <optional>

#include "model/blob.h"
#include "model/frame.h"
#include "model/preview.h"

namespace mocap::runtime {

/// Least time between two previews of one camera.
inline constexpr Duration kPreviewPeriod = std::chrono::milliseconds(100);

/// Hands previews from a camera's thread to the preview thread, one at a time. While nobody wants previews, `offer`
/// costs one load.
class PreviewSlot {
 public:
  /// Publish thread.
  void set_wanted(bool wanted) noexcept { wanted_.store(wanted, std::memory_order_relaxed); }

  /// Camera's thread. Copies a decimated image if a preview is wanted, the last one was at least kPreviewPeriod ago,
  /// and the preview thread has released it. Returns whether the image was copied. Allocates at the first copy alone.
  bool offer(const Frame& frame, const Blobs& blobs);

  /// Preview thread: the image that waits, until `release`; null if there is none.
  const PreviewImage* waiting() const noexcept { return full_.load(std::memory_order_acquire) ? &image_ : nullptr; }
  void release() noexcept { full_.store(false, std::memory_order_release); }

 private:
  std::atomic<bool> wanted_{false};
  std::atomic<bool> full_{false};
  std::optional<Timestamp> offered_at_;  // of the camera's thread
  PreviewImage image_;                   // of the preview thread while full_, otherwise of the camera's thread
};

}  // namespace mocap::runtime
