#include "cameras/clock/peer_clock.h"

#include <algorithm>
#include <cmath>

namespace mocap::cameras {
namespace {

// Without echoes the offset drifts from the line by the uncertainty of the drift: two crystals after 10 s of echoes.
constexpr double kDriftUncertainty = 5e-6;
// Until the mappings have a window, the error is uniform within half of the shortest round trip.
constexpr std::uint64_t kFewEchoes = 20;
const double kUniform = 1.0 / std::sqrt(3.0);

}  // namespace

void PeerClock::reset() { *this = PeerClock{}; }

void PeerClock::add(const Echo& echo) {
  const Duration at_peer = echo.sent_at - echo.received_at;
  const Duration round_trip = (echo.arrived_at - echo.called_at) - at_peer;
  if (at_peer < Duration::zero() || round_trip < Duration::zero()) return;
  const Duration from_peer = from_peer_.map(echo.sent_at.time_since_epoch(), echo.arrived_at) - echo.sent_at;
  const Duration to_peer = to_peer_.map(echo.called_at.time_since_epoch(), echo.received_at) - echo.called_at;
  ++echoes_;
  round_trip_ = std::min(round_trip_, round_trip);
  offset_ = (from_peer - to_peer) / 2;
  drift_ = 0.5 * (from_peer_.drift() - to_peer_.drift());
  peer_at_ = echo.sent_at;
  heard_at_ = echo.arrived_at;
  const double both_s = 0.5 * std::hypot(to_s(from_peer_.uncertainty()), to_s(to_peer_.uncertainty()));
  const double bound_s = 0.5 * kUniform * to_s(round_trip_);
  uncertainty_ = from_s(echoes_ < kFewEchoes ? bound_s : both_s);
}

Timestamp PeerClock::to_host(Timestamp peer) const {
  const Duration since = peer - peer_at_;
  return peer + offset_ + from_s(drift_ * to_s(since));
}

Duration PeerClock::uncertainty(Timestamp now) const {
  const double silent_s = std::max(0.0, to_s(now - heard_at_));
  return from_s(std::hypot(to_s(uncertainty_), kDriftUncertainty * silent_s));
}

}  // namespace mocap::cameras
