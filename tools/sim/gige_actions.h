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

/// The keys with which a camera selects action commands.
struct ActionKeys {
  std::uint32_t device = 0, group = 0, mask = 0;
};

/// Queue of the exposure instants requested by action commands, immediate or scheduled in camera time. One thread adds
/// commands, another thread takes the instants.
///
/// Source: GigE Vision 2.0, part "GVCP" (ACTION_CMD).
class GigeActions {
 public:
  enum class Answer : std::uint16_t {
    Done = 0x0000,
    NotForUs = 0xffff,         ///< the keys differ; no acknowledge is sent
    NoReferenceTime = 0x8013,  ///< a scheduled command requires a clock that follows PTP
    Overflow = 0x8015,         ///< the queue is full
    Late = 0x8016,             ///< the scheduled time has passed; the camera exposes immediately
  };

  /// Adds the exposure of a command that arrived at `arrived_utc_ns`. Returns the status of the acknowledge.
  Answer take(std::uint8_t flags, std::span<const std::uint8_t> data, const ActionKeys& keys, const CameraClock& clock,
              std::int64_t arrived_utc_ns);

  /// Removes the earliest exposure instant (UTC) from the queue. Waits at most `patience` for a command, but does not
  /// wait for the instant itself. Empty if no command came.
  std::optional<std::int64_t> next_utc_ns(Duration patience);

  /// Removes all instants, for example when the client restarts the acquisition.
  void clear();

 private:
  static constexpr std::size_t kQueue = 16;

  std::mutex mutex_;
  std::condition_variable command_added_;
  std::deque<std::int64_t> due_utc_ns_;
};

}  // namespace mocap::sim
