#include "cameras/node/node_clock.h"

#include <algorithm>

#include "wire/node_protocol.h"

namespace mocap::cameras {
namespace {

// The spans of 3 s are kept: a camera whose images wait longer has lost them.
constexpr Duration kLineEvery = std::chrono::milliseconds(100);
// An exposure further ahead of the last echo is wrong, and must not hold back all later estimates.
constexpr Duration kFurthestAhead = std::chrono::seconds(1);

}  // namespace

Duration NodeClock::call_every() const noexcept {
  const int cameras = std::max(1, cameras_.load(std::memory_order_relaxed));
  return std::min<Duration>(wire::kNodeCallEvery * cameras, wire::kNodeLease / 4);
}

void NodeClock::begin(std::uint64_t session) {
  session_ = session;
  clock_.reset();
  spans_.clear();
  converted_ = Timestamp::min();
}

void NodeClock::add(std::uint64_t session, const Echo& echo, const std::optional<MeasuredLine>& by_ptp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (session != session_ || !clock_.known()) {
    if (clock_.known() && echo.called_at < called_at_) return;
    begin(session);
  }
  if (!clock_.add(echo, by_ptp)) return;
  called_at_ = echo.called_at;
  renew_line();
}

void NodeClock::renew_line() {
  const PeerLine& line = clock_.line();
  const bool set_back = !spans_.empty() && line.peer_at < spans_.back().line.peer_at;
  if (set_back) {
    spans_.clear();
    converted_ = Timestamp::min();
  }
  if (!spans_.empty() && line.peer_at - spans_.back().line.peer_at < kLineEvery) return;
  if (spans_.size() == kSpans) {
    std::copy(spans_.begin() + 1, spans_.end(), spans_.begin());
    spans_.pop_back();
  }
  spans_.push_back({spans_.empty() ? Timestamp::min() : converted_ + Duration{1}, line});
}

std::optional<NodeInstants> NodeClock::to_host(std::uint64_t session, Timestamp exposed_at, Timestamp received_at,
                                               Timestamp now) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (session != session_ || spans_.empty()) return std::nullopt;
  converted_ = std::max(converted_, std::min(exposed_at, spans_.back().line.peer_at + kFurthestAhead));
  auto span = spans_.end() - 1;
  while (span != spans_.begin() && span->from > exposed_at) --span;
  return NodeInstants{span->line.to_host(exposed_at), span->line.to_host(received_at), clock_.uncertainty(now)};
}

std::optional<NodeClockState> NodeClock::state(std::uint64_t session, Timestamp now) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (session != session_ || spans_.empty()) return std::nullopt;
  return NodeClockState{clock_.uncertainty(now), clock_.round_trip(), clock_.source()};
}

NodeClock& NodeClocks::of(const std::string& endpoint) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::unique_ptr<NodeClock>& clock = clocks_[endpoint];
  if (!clock) clock = std::make_unique<NodeClock>();
  return *clock;
}

}  // namespace mocap::cameras
