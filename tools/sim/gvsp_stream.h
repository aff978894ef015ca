#pragma once

#include <netinet/in.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <random>
#include <span>
#include <vector>

#include "base/time.h"

namespace mocap::sim {

/// What stands in the leader of an image.
struct ServedImage {
  std::uint16_t id = 0;  ///< 1 to 65535
  std::uint64_t stamp_ns = 0;
  std::uint32_t pixel_format = 0;  ///< GenICam PFNC
  std::uint32_t width = 0, height = 0, left = 0, top = 0;
  bool chunks = false;               ///< more follows the pixels
  std::uint64_t chunk_stamp_ns = 0;  ///< what stands there
  double exposure_us = 0.0;          ///< the same
};

/// Where packets go, and how.
struct StreamRoute {
  sockaddr_in to{};
  std::uint32_t packet_bytes = 1400;  ///< with the headers of IP, UDP and GVSP
  Duration packet_delay{};            ///< between two packets, as the client asked for it
};

/// The sending side of one GigE Vision stream channel: leader, payload and trailer packets of each image, and again
/// those that are asked for. Keeps the last images for that.
///
/// One thread fills and sends; any thread resends. Source: GigE Vision 2.0, part "GVSP".
class GvspStream {
 public:
  /// Of the packets, this share is lost: those that are sent again, too.
  GvspStream(double lost_share, std::uint64_t seed);
  ~GvspStream();
  GvspStream(const GvspStream&) = delete;
  GvspStream& operator=(const GvspStream&) = delete;

  /// Sends from this address, network order. False: the system gives no socket there.
  bool open(in_addr from);

  /// Room for the next image, to be filled before `send`.
  std::span<std::byte> room(std::size_t bytes);

  /// Sends what was filled in and `behind` it; may be called again for the same image. `room` makes place for the next.
  void send(const ServedImage& image, std::span<const std::byte> behind, const StreamRoute& route);

  /// Does what `send` will do first, to nobody: what the processor has forgotten of it since the last image makes no
  /// image late.
  void rehearse(const ServedImage& image, const StreamRoute& route);

  /// Sends packets `first` to `last` of an image again; nothing where it is forgotten already.
  void resend(std::uint16_t id, std::uint32_t first, std::uint32_t last);

  /// One packet of the length that the client wants to try.
  void send_test_packet(const StreamRoute& route);

 private:
  static constexpr std::size_t kKept = 16;  // at 120 Hz 130 ms, longer than a client asks for packets

  struct Kept {
    std::vector<std::byte> payload;
    ServedImage image;
    StreamRoute route;
    bool whole = false;

    std::uint32_t payload_bytes() const;
    std::uint32_t last_packet() const;
  };

  void transmit(const Kept& kept, std::uint32_t first, std::uint32_t last);

  double lost_share_;
  std::uint64_t seed_;
  std::atomic<std::uint64_t> sendings_{0};
  int socket_ = -1;
  sockaddr_in own_{};
  std::mutex mutex_;  // for the ring
  std::array<Kept, kKept> ring_;
  Kept rehearsed_;
  std::size_t next_ = 0;
};

}  // namespace mocap::sim
