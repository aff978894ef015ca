#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <span>

#include "base/time.h"
#include "camera_clock.h"

namespace mocap::sim {

/// What a camera is set to do on action commands.
struct ActionKeys {
  std::uint32_t device = 0, group = 0, mask = 0;
};

/// The instants at which a camera was told to expose by action commands, at once or at a time of its own clock. One
/// thread takes commands, another takes the instants.
///
/// Source: GigE Vision 2.0, part "GVCP" (ACTION_CMD).
class GigeActions {
 public:
  enum class Answer : std::uint16_t {
    Done = 0x0000,
    NotForUs = 0xffff,  ///< no answer is sent
    NoReferenceTime = 0x8013,
    Overflow = 0x8015,
    Late = 0x8016,  ///< and done at once
  };

  /// `flags` and `data` of a command that arrived at `arrived_utc_ns`.
  Answer take(std::uint8_t flags, std::span<const std::uint8_t> data, const ActionKeys& keys, const CameraClock& clock,
              std::int64_t arrived_utc_ns);

  /// The next instant of UTC, once; waits for it to be told, no longer than `patience`, but not for it to come.
  std::optional<std::int64_t> next_utc_ns(Duration patience);

  /// Forgets what waits: the client begins anew.
  void clear();

 private:
  static constexpr std::size_t kQueue = 16;

  std::mutex mutex_;
  std::condition_variable told_;
  std::deque<std::int64_t> due_utc_ns_;
};

}  // namespace mocap::sim
