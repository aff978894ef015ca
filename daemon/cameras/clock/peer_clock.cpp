#include "cameras/clock/peer_clock.h"

#include <algorithm>
#include <cmath>

namespace mocap::cameras {
namespace {

// Without echoes the offset drifts from the line by the uncertainty of the drift: two crystals after 10 s of echoes.
constexpr double kDriftUncertainty = 5e-6;
// The bound of an echo widens by this share of the time since: more than crystals differ from the estimated drift in
// the first seconds (ClockMapping has 50 ppm as their standard deviation).
constexpr double kBoundWidens = 100e-6;
// An echo that was sent this much earlier than the last one was not overtaken: the peer's clock was set back.
constexpr Duration kSetBack = std::chrono::seconds(1);
// Until the mappings have a window, the error is uniform within half of the shortest round trip.
constexpr std::uint64_t kFewEchoes = 20;
const double kUniform = 1.0 / std::sqrt(3.0);

}  // namespace

void PeerClock::reset() { *this = PeerClock{}; }

bool PeerClock::is_overtaken(const Echo& echo) const {
  if (echoes_ == 0) return false;
  return echo.called_at <= called_at_ || (echo.sent_at <= line_.peer_at && line_.peer_at - echo.sent_at < kSetBack);
}

bool PeerClock::add(const Echo& echo, const std::optional<MeasuredLine>& measured) {
  const Duration at_peer = echo.sent_at - echo.received_at;
  const Duration round_trip = (echo.arrived_at - echo.called_at) - at_peer;
  if (at_peer < Duration::zero() || round_trip < Duration::zero() || is_overtaken(echo)) return false;
  const Duration from_peer = from_peer_.map(echo.sent_at.time_since_epoch(), echo.arrived_at) - echo.sent_at;
  const Duration to_peer = to_peer_.map(echo.called_at.time_since_epoch(), echo.received_at) - echo.called_at;
  ++echoes_;
  called_at_ = echo.called_at;
  heard_at_ = echo.arrived_at;
  round_trip_ = std::min(round_trip_, round_trip);
  line_ = {echo.sent_at, (from_peer - to_peer) / 2, 0.5 * (from_peer_.drift() - to_peer_.drift())};
  keep_within_bound(echo, round_trip);
  const double bound_s = kUniform * half_at_s(echo.sent_at);
  const double both_s = 0.5 * std::hypot(to_s(from_peer_.uncertainty()), to_s(to_peer_.uncertainty()));
  uncertainty_ = from_s(echoes_ < kFewEchoes ? bound_s : std::min(bound_s, both_s));
  source_ = PeerLineSource::Echoes;
  if (!measured) return true;
  if (!is_within_bound(measured->line)) {
    source_ = PeerLineSource::Contradicted;
  } else if (measured->uncertainty < uncertainty_) {
    source_ = PeerLineSource::Measured;
    line_ = measured->line;
    uncertainty_ = measured->uncertainty;
  }
  return true;
}

// Largest error of the bound at an instant of the peer, s.
double PeerClock::half_at_s(Timestamp peer) const { return bound_.half_s + kBoundWidens * to_s(peer - bound_.peer_at); }

// Follows the narrowest bound and moves the offset into it.
void PeerClock::keep_within_bound(const Echo& echo, Duration round_trip) {
  const Duration middle = ((echo.arrived_at - echo.sent_at) - (echo.received_at - echo.called_at)) / 2;
  const double half_s = 0.5 * to_s(round_trip);
  const double most_s = half_at_s(echo.sent_at);
  const Duration centre = bound_.offset + from_s(line_.drift * to_s(echo.sent_at - bound_.peer_at));
  // Bounds that do not overlap: the peer's clock jumped.
  const bool jumped = echo.sent_at < bound_.peer_at || std::abs(to_s(middle - centre)) > half_s + most_s;
  if (echoes_ == 1 || jumped || half_s < most_s) {
    bound_ = {echo.sent_at, middle, half_s};
    line_.offset = std::clamp(line_.offset, middle - from_s(half_s), middle + from_s(half_s));
  } else {
    line_.offset = std::clamp(line_.offset, centre - from_s(most_s), centre + from_s(most_s));
  }
}

bool PeerClock::is_within_bound(const PeerLine& line) const {
  const Duration centre = bound_.offset + from_s(line_.drift * to_s(line.peer_at - bound_.peer_at));
  return std::abs(to_s(line.offset - centre)) <= half_at_s(line.peer_at);
}

Duration PeerClock::uncertainty(Timestamp now) const {
  const double silent_s = std::max(0.0, to_s(now - heard_at_));
  return from_s(std::hypot(to_s(uncertainty_), kDriftUncertainty * silent_s));
}

}  // namespace mocap::cameras
