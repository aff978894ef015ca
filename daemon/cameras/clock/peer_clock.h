#pragma once

#include "base/time.h"
#include "cameras/clock/clock_mapping.h"

namespace mocap::cameras {

/// The four instants of one echo.
struct Echo {
  Timestamp called_at;    ///< host's clock: the host sent its call
  Timestamp received_at;  ///< peer's clock: the peer received the call
  Timestamp sent_at;      ///< peer's clock: the peer sent the echo
  Timestamp arrived_at;   ///< host's clock: the echo arrived
};

/// Converts times of another machine's clock to the host's clock, from echoes over the same connection.
///
/// Each direction has a ClockMapping: the line below all one-way delays, with the drift. The offset is the mean of both
/// lines, so equal minimum delays cancel. Unequal minimum delays are not observable; their difference is at most the
/// shortest round trip, which bounds the error by half of it.
///
/// Deterministic. Never allocates. One thread.
class PeerClock {
 public:
  /// Adds an echo. An echo whose instants contradict each other is left out.
  void add(const Echo& echo);

  /// Forgets everything. Call this when the peer was started again.
  void reset();

  /// Whether there was an echo.
  bool known() const { return echoes_ > 0; }
  /// The host's time of an instant on the peer's clock. Requires known().
  Timestamp to_host(Timestamp peer) const;
  /// Standard deviation of to_host() for equal minimum delays; grows with the time since the last echo.
  Duration uncertainty(Timestamp now) const;

  /// Seconds that the host's clock gains per second of the peer's clock.
  double drift() const { return drift_; }
  /// Shortest round trip so far.
  Duration round_trip() const { return round_trip_; }

 private:
  ClockMapping from_peer_;  // the echo: sent at peer's time, arrived at host's time
  ClockMapping to_peer_;    // the call: sent at host's time, received at peer's time
  std::uint64_t echoes_ = 0;
  Timestamp peer_at_;  // of the last echo
  Timestamp heard_at_;
  Duration offset_{};  // host minus peer at peer_at_
  double drift_ = 0.0;
  Duration uncertainty_{};
  Duration round_trip_ = Duration::max();
};

}  // namespace mocap::cameras
