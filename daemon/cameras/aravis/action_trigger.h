#pragma once

#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <memory>

#include "base/result.h"
#include "base/time.h"

namespace mocap::cameras {

/// What a camera must be set to, so that it takes our action commands for its own.
inline constexpr std::uint32_t kActionDeviceKey = 0x6d6f6361;
inline constexpr std::uint32_t kActionGroupKey = 1;
inline constexpr std::uint32_t kActionGroupMask = 0xffffffff;

/// Tells one GigE Vision camera when to expose, by action commands. All exposures begin at whole multiples of the
/// period, so that cameras of one period expose together though nobody tells one of the other.
///
/// A camera that keeps PTP time is told ahead, by that time: it exposes as precisely as it keeps the time. One that
/// does not is told at the instant itself, by the host's UTC: as precisely as this thread is woken, some 0.1 ms.
///
/// A camera that loses its master says so by refusing what it is told ahead, some 0.1 s before it would have exposed:
/// from that exposure on it is told at the instant, by what the host knows of the master's time (UTC or TAI; of a
/// master with a time of its own what this camera showed last, some milliseconds late). So none is left out, and none
/// is told twice.
///
/// One thread. Source: GigE Vision 2.0, part "GVCP" (ACTION_CMD).
class ActionTrigger {
 public:
  /// A socket from this host's address to the camera's. Fails with Io.
  static Result<std::unique_ptr<ActionTrigger>> open(in_addr host, in_addr camera, Duration period);
  ~ActionTrigger();
  ActionTrigger(const ActionTrigger&) = delete;
  ActionTrigger& operator=(const ActionTrigger&) = delete;

  /// What the camera's clock is ahead of the host's, within some milliseconds: says which multiples are still to come.
  void set_clock(Duration camera_minus_host) { camera_minus_host_ = camera_minus_host; }

  /// Whether the camera refuses to be told ahead, since it was last told at the instant for another reason.
  bool refused() const { return refused_; }

  /// Asks the camera whether it takes an action by its own time. Waits for the answer, 1 s at most; a camera that gives
  /// none is believed. Fails with Unsupported.
  Status probe(Timestamp now);

  /// Sends what is due: with `ahead` all exposures of the next 0.1 s (8 at most) by the camera's time, else the one
  /// whose instant is now. What is past is left out. Never waits, never allocates.
  void send_due(Timestamp now, Duration utc_minus_host, bool ahead);

  /// When to call `send_due` again; before its first call: at once.
  Timestamp next_due() const { return next_due_; }

 private:
  ActionTrigger(int socket, Duration period) : socket_(socket), period_(period) {}
  void send(std::uint8_t flags, Duration at);
  void skip_to(Duration clock);
  void take_answers();
  void learn_common_clock(Duration utc_minus_host);

  int socket_;
  Duration period_;
  Duration camera_minus_host_{};
  Duration common_minus_utc_{};  // of the clock by whose multiples all cameras expose
  Duration next_{};              // the next exposure, by that clock
  bool ahead_ = false;
  bool begun_ = false;
  bool refused_ = false;
  struct Told {
    std::uint16_t request = 0;
    Duration at{};
  };
  std::array<Told, 16> told_{};  // ahead, by request
  Timestamp next_due_;
  std::uint16_t request_ = 0;
};

}  // namespace mocap::cameras
