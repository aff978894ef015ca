#pragma once

#include <netinet/in.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "base/time.h"

namespace mocap::cameras {

/// Tells when the first packet of a GigE Vision image arrived, as the kernel stamped it: whatever keeps the thread that
/// receives from running (its waking, other threads, the host) is not in it, other than in a stamp that this thread
/// takes.
///
/// A packet socket beside the stream's own, whose filter lets the leaders of one stream through and nothing else; works
/// on loopback too. Needs CAP_NET_RAW. One thread.
///
/// Source: GigE Vision 2.0, part "GVSP" (leader, extended ids); packet(7), socket(7) (SO_TIMESTAMPNS).
class ArrivalStamps {
 public:
  /// Of the stream from `camera` to this host's UDP port; null where the system does not allow it.
  static std::unique_ptr<ArrivalStamps> open(in_addr camera, std::uint16_t port);

  ~ArrivalStamps();
  ArrivalStamps(const ArrivalStamps&) = delete;
  ArrivalStamps& operator=(const ArrivalStamps&) = delete;

  /// When the leader of the image with this id arrived for the first time, since the Unix epoch (UTC); nothing where it
  /// was lost or is long ago. Never waits, never allocates.
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
