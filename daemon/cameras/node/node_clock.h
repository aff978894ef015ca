#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "cameras/clock/peer_clock.h"

namespace mocap::cameras {

/// The instants of one image on the host's clock.
struct NodeInstants {
  Timestamp exposed_at;
  Timestamp received_at;
  Duration uncertainty{};  ///< standard deviation
};

/// How well the clock of a node is known.
struct NodeClockState {
  Duration uncertainty{};
  Duration round_trip{};  ///< the shortest one
  PeerLineSource source = PeerLineSource::Echoes;
};

/// The clock of one node, shared by all cameras that come from the node (decisions/0014). Each camera adds the echoes
/// of its connection, and an instant of the node is the same instant of the host for all cameras: a new estimate holds
/// for instants after all those that were converted before.
///
/// Any thread. Each call holds a lock for a few microseconds. Never allocates.
class NodeClock {
 public:
  /// A camera that uses the clock, from its construction to its destruction.
  void join() noexcept { cameras_.fetch_add(1, std::memory_order_relaxed); }
  void leave() noexcept { cameras_.fetch_sub(1, std::memory_order_relaxed); }

  /// Time between two calls of one camera: the more cameras share the clock, the fewer echoes of each are needed.
  Duration call_every() const noexcept;

  /// Adds an echo. Another session than before is another clock, which begins anew; an echo of an older session is left
  /// out. `by_ptp`: the line of the node's clock at echo.sent_at, where both machines follow one PTP grandmaster.
  void add(std::uint64_t session, const Echo& echo, const std::optional<MeasuredLine>& by_ptp = {});

  /// Converts the instants of an image, whose exposure decides which estimate is used. Empty if no echo of this session
  /// was added yet.
  std::optional<NodeInstants> to_host(std::uint64_t session, Timestamp exposed_at, Timestamp received_at,
                                      Timestamp now);

  /// Empty if no echo of this session was added yet.
  std::optional<NodeClockState> state(std::uint64_t session, Timestamp now) const;

 private:
  // Converts instants of the node from `from` on, until the next line begins.
  struct Span {
    Timestamp from;
    PeerLine line;
  };
  static constexpr std::size_t kSpans = 32;

  void begin(std::uint64_t session);
  void renew_line();

  std::atomic<int> cameras_{0};
  mutable std::mutex mutex_;  // guards all below
  std::uint64_t session_ = 0;
  Timestamp called_at_;
  PeerClock clock_;
  BoundedVector<Span, kSpans> spans_;       // the newest is the last
  Timestamp converted_ = Timestamp::min();  // the latest exposure so far
};

/// The clocks of all nodes of this host, by the address of the node. Any thread; the clocks live as long as this
/// object.
class NodeClocks {
 public:
  NodeClock& of(const std::string& endpoint);

 private:
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<NodeClock>> clocks_;
};

}  // namespace mocap::cameras
