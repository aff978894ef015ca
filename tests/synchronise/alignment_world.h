#pragma once

#include <chrono>
#include <cstdint>

#include "synchronise/frame_aligner.h"

namespace mocap::synchronise {

inline Timestamp at(std::int64_t us) { return Timestamp{} + std::chrono::microseconds(us); }

/// A frame without blobs, detected `delay_us` after its exposure.
inline BlobFrame seen_by(std::uint32_t camera, std::int64_t us, std::int64_t delay_us = 0) {
  BlobFrame frame;
  frame.camera = CameraId{camera};
  frame.exposed_at = at(us);
  frame.received_at = at(us + delay_us);
  frame.detected_at = at(us + delay_us);
  return frame;
}

inline constexpr AlignSettings kSettings{.window = std::chrono::microseconds(500),
                                         .patience = std::chrono::microseconds(2000)};
inline constexpr Timestamp kForever = Timestamp::min();  // patience never runs out

}  // namespace mocap::synchronise
