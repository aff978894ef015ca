#pragma once

#include <cstdint>
#include <optional>

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

/// A clock of a peer near one of its instants, as a line.
struct PeerLine {
  Timestamp peer_at;
  Duration offset{};   ///< host minus peer at peer_at
  double drift = 0.0;  ///< seconds that the host's clock gains per second of the peer's clock

  Timestamp to_host(Timestamp peer) const { return peer + offset + from_s(drift * to_s(peer - peer_at)); }
};

/// A line that was measured independently of the echoes, by PTP.
struct MeasuredLine {
  PeerLine line;
  Duration uncertainty{};  ///< standard deviation of the offset
};

/// The measurement from which the line of a PeerClock comes.
enum class PeerLineSource {
  Echoes,        ///< the echoes: there is no MeasuredLine, or it is less certain
  Measured,      ///< the MeasuredLine
  Contradicted,  ///< the echoes: the MeasuredLine lies outside the bound that they give
};

/// Converts times of another machine's clock to the host's clock, from echoes over one or several connections.
///
/// Each direction has a ClockMapping: the line below all one-way delays, with the drift. The offset is the mean of both
/// lines, so equal minimum delays cancel. Unequal minimum delays are not observable; their difference is at most the
/// shortest round trip, which bounds the error by half of it. Each echo bounds the offset by half of its round trip,
/// and later by the drift that is possible since: the offset is kept within the narrowest of these bounds.
///
/// A line that was measured otherwise (by PTP) is used instead if it is more certain and lies within the bound. Outside
/// of the bound it is wrong, whatever uncertainty it states.
///
/// Deterministic. Never allocates. One thread.
///
/// Source of the bounds: Marzullo and Owicki, "Maintaining the time in a distributed system" (PODC 1983).
class PeerClock {
 public:
  /// Adds an echo. Returns false, and leaves the echo out, if its instants contradict each other or if an echo that was
  /// called or sent later came before: connections overtake each other. `measured`: the line at echo.sent_at, if it was
  /// measured otherwise too.
  bool add(const Echo& echo, const std::optional<MeasuredLine>& measured = {});

  /// Forgets everything. Call this when the peer was started again.
  void reset();

  /// Whether there was an echo.
  bool known() const { return echoes_ > 0; }
  /// The host's time of an instant on the peer's clock. Requires known().
  Timestamp to_host(Timestamp peer) const { return line_.to_host(peer); }
  /// The line of the last echo. Requires known().
  const PeerLine& line() const { return line_; }
  /// Standard deviation of to_host() for equal minimum delays; grows with the time since the last echo.
  Duration uncertainty(Timestamp now) const;

  double drift() const { return line_.drift; }
  /// The source of the line since the last echo.
  PeerLineSource source() const { return source_; }
  /// Shortest round trip so far.
  Duration round_trip() const { return round_trip_; }

 private:
  // The offset at an instant of the peer, from one echo.
  struct Bound {
    Timestamp peer_at;
    Duration offset{};
    double half_s = 0.0;  // largest error
  };

  bool is_overtaken(const Echo& echo) const;
  double half_at_s(Timestamp peer) const;
  void keep_within_bound(const Echo& echo, Duration round_trip);
  bool is_within_bound(const PeerLine& line) const;

  ClockMapping from_peer_;  // the echo: sent at peer's time, arrived at host's time
  ClockMapping to_peer_;    // the call: sent at host's time, received at peer's time
  std::uint64_t echoes_ = 0;
  Timestamp called_at_;  // of the last echo
  Timestamp heard_at_;
  PeerLine line_;
  Bound bound_;
  Duration uncertainty_{};
  PeerLineSource source_ = PeerLineSource::Echoes;
  Duration round_trip_ = Duration::max();
};

}  // namespace mocap::cameras
