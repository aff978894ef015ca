#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/time.h"

namespace mocap::cameras {

/// Reads the arrival time of the first packet (leader) of each GigE Vision image from the kernel. Unlike a time stamp
/// taken by the receive thread, the kernel's stamp contains no delay of a thread or of the scheduler (decisions/0008).
///
/// Uses a packet socket beside the stream's socket, with a filter that passes only the leaders of one stream. Works on
/// loopback too. Needs CAP_NET_RAW. One thread.
///
/// Source: GigE Vision 2.0, part "GVSP" (leader, extended ids); packet(7), socket(7) (SO_TIMESTAMPNS).
class ArrivalStamps {
 public:
  /// Opens the socket for the stream from `camera` to this host's UDP port `port`. Null if the system does not permit
  /// it.
  static std::unique_ptr<ArrivalStamps> open(in_addr camera, std::uint16_t port);

  ~ArrivalStamps();
  ArrivalStamps(const ArrivalStamps&) = delete;
  ArrivalStamps& operator=(const ArrivalStamps&) = delete;

  /// First arrival of the leader of the image `frame_id`, since the Unix epoch (UTC). Absent if the leader was lost or
  /// is not among the last 64. Never waits, never allocates.
  std::optional<Duration> arrival_utc(std::uint64_t frame_id);

 private:
  static constexpr std::size_t kKept = 64;

  struct Arrival {
    std::uint16_t id = 0;
    Duration utc{};  ///< 0: none
  };

  explicit ArrivalStamps(int socket) : socket_(socket) {}
  void take_in();
  Arrival* find(std::uint16_t id);

  int socket_;
  std::array<Arrival, kKept> ring_;
  std::size_t next_ = 0;
};

}  // namespace mocap::cameras
