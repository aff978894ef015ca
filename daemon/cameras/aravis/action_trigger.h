#pragma once

#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <memory>

#include "base/result.h"
#include "base/time.h"

namespace mocap::cameras {

struct ImageInstants;

/// Device key, group key and group mask that a camera must be set to, so that it accepts the action commands of this
/// daemon.
inline constexpr std::uint32_t kActionDeviceKey = 0x6d6f6361;
inline constexpr std::uint32_t kActionGroupKey = 1;
inline constexpr std::uint32_t kActionGroupMask = 0xffffffff;

/// Commands the exposures of one GigE Vision camera by action commands. Each exposure begins at a whole multiple of the
/// period, so that cameras of equal period expose together without communication between their threads
/// (decisions/0009).
///
/// A camera that keeps PTP time gets each command ahead of time, scheduled by the camera's clock: the exposure is as
/// precise as that clock. Another camera gets each command at exposure time, by the host's UTC: the exposure is as
/// precise as the wake-up of this thread, about 0.1 ms.
///
/// A camera that loses its PTP master refuses scheduled commands, about 0.1 s before their exposures. From the first
/// refused exposure on, the camera gets immediate commands, by the host's estimate of the master's time: UTC or TAI,
/// or, if the master has another time scale, the last value of the camera's clock, some milliseconds late. No exposure
/// is omitted and no exposure is commanded twice (decisions/0011).
///
/// One thread. Source: GigE Vision 2.0, part "GVCP" (ACTION_CMD).
class ActionTrigger {
 public:
  /// Opens a socket from this host's address to the camera's address. Fails with Io.
  static Result<std::unique_ptr<ActionTrigger>> open(in_addr host, in_addr camera, Duration period);
  ~ActionTrigger();
  ActionTrigger(const ActionTrigger&) = delete;
  ActionTrigger& operator=(const ActionTrigger&) = delete;

  /// Sets the difference of the camera's clock and the host's clock, correct within some milliseconds. The difference
  /// determines which multiples of the period are in the future.
  void set_clock(Duration camera_minus_host) { camera_minus_host_ = camera_minus_host; }

  /// The same by the end of an exposure and the arrival of its first packet; without that arrival, the clock stays. The
  /// thread may take the image from the queue long after that: by then, the clock would seem to jump back.
  void read_clock(const ImageInstants& image);

  /// True after the camera refused a scheduled command, until send_due() is called with `ahead` = false.
  bool refused() const { return refused_; }

  /// Tests whether the camera accepts scheduled commands: sends up to 4 and waits for an acknowledgement, 1 s at most.
  /// A camera that does not answer counts as one that accepts them. Fails with Unsupported.
  Status probe(Timestamp now);

  /// Sends the commands that are due. With `ahead`: the commands of all exposures of the next 0.1 s (8 at most),
  /// scheduled by the camera's clock. Otherwise: the command of the exposure that begins at `now`. Skips past
  /// exposures. Never waits, never allocates.
  void send_due(Timestamp now, Duration utc_minus_host, bool ahead);

  /// Time of the next call of send_due(). Before the first call: a time in the past.
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
  Duration common_minus_utc_{};  // exposures begin at multiples of the period on the common clock
  Duration next_{};              // begin of the next exposure on the clock in use
  bool ahead_ = false;
  bool begun_ = false;
  bool refused_ = false;
  struct Command {
    std::uint16_t request = 0;
    Duration at{};
  };
  std::array<Command, 16> commands_{};  // scheduled commands, at index request % size
  Timestamp next_due_;
  std::uint16_t request_ = 0;
};

}  // namespace mocap::cameras
