#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "bench/bridges/arrivals.h"
#include "bridges/lib/udp_socket.h"

namespace mocap::bench {

/// Reads the number of the frame that a packet shows; empty: it shows none.
using NumberReader = std::function<std::optional<std::uint64_t>(std::string_view packet)>;

/// What a receiver does to get frames. Called by the thread of the receivers.
class Joining {
 public:
  virtual ~Joining() = default;

  /// Asks for frames. Called again until the first frame comes.
  virtual void ask(const bridge::UdpSocket& socket) = 0;
  /// Takes a packet that shows no frame.
  virtual void answer(const bridge::UdpSocket& socket, std::string_view packet) = 0;
  /// Called at every turn: reads and forgets what comes by other ways.
  virtual void drain() {}
};

/// A NatNet client of the bridge at this port of this machine: asks to connect, then for the descriptions.
std::unique_ptr<Joining> join_natnet(std::uint16_t port);
/// A VRPN client: connects by TCP and asks for reports by UDP.
std::unique_ptr<Joining> join_vrpn(std::uint16_t port);
/// A receiver that gets packets without asking.
std::unique_ptr<Joining> join_silently();

/// Receivers of one bridge on UDP ports of this machine, served by one thread. Each notes when it had which frame.
class Receivers {
 public:
  /// Opens `count` ports. `joining` is called for each receiver by run(), so that the bridge can start between.
  static Result<Receivers> open(std::size_t count);

  const std::vector<std::uint16_t>& ports() const { return ports_; }

  /// Serves the sockets until the stop. `joined` counts the receivers that got a frame.
  void run(const std::stop_token& stop, const std::function<std::unique_ptr<Joining>()>& joining,
           const NumberReader& number, Arrivals& arrivals, std::atomic<std::size_t>& joined);

 private:
  struct One {
    bridge::UdpSocket socket;
    std::unique_ptr<Joining> joining;
    std::optional<std::uint64_t> frame;  // the newest
  };

  Receivers() = default;
  void read(std::size_t index, const NumberReader& number, Arrivals& arrivals, std::atomic<std::size_t>& joined);

  std::vector<One> all_;
  std::vector<std::uint16_t> ports_;
};

}  // namespace mocap::bench
