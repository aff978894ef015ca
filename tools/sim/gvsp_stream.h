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

/// Content of the leader of an image.
struct ServedImage {
  std::uint16_t id = 0;  ///< 1 to 65535
  std::uint64_t stamp_ns = 0;
  std::uint32_t pixel_format = 0;  ///< GenICam PFNC
  std::uint32_t width = 0, height = 0, left = 0, top = 0;
  bool chunks = false;               ///< chunks follow the pixels
  std::uint64_t chunk_stamp_ns = 0;  ///< value of the time stamp chunk
  double exposure_us = 0.0;          ///< value of the exposure chunk
};

/// Destination, size and spacing of packets.
struct StreamRoute {
  sockaddr_in to{};
  std::uint32_t packet_bytes = 1400;  ///< includes the headers of IP, UDP and GVSP
  Duration packet_delay{};            ///< between two packets, set by the client
};

/// The sender of one GigE Vision stream channel: leader, payload and trailer packets of each image, and packet resend.
/// Retains the last images for resend. One thread calls room() and send(); any thread may call resend(). Source: GigE
/// Vision 2.0, part "GVSP".
class GvspStream {
 public:
  /// `lost_share`: probability that a packet, including a resent packet, is not sent.
  GvspStream(double lost_share, std::uint64_t seed);
  ~GvspStream();
  GvspStream(const GvspStream&) = delete;
  GvspStream& operator=(const GvspStream&) = delete;

  /// Binds the socket to an address in network byte order. Returns false if the system refuses the address.
  bool open(in_addr from);

  /// The payload buffer of the next image. Fill it before send().
  std::span<std::byte> room(std::size_t bytes);

  /// Sends the payload followed by the bytes of `behind`. May be called again for the same image. room() starts the
  /// next image.
  void send(const ServedImage& image, std::span<const std::byte> behind, const StreamRoute& route);

  /// Runs the first part of send() without a receiver, to warm the processor's caches before an image is due.
  void rehearse(const ServedImage& image, const StreamRoute& route);

  /// Sends packets `first` to `last` of an image again. Does nothing if the image is no longer retained.
  void resend(std::uint16_t id, std::uint32_t first, std::uint32_t last);

  /// Sends one test packet of the packet size that the client negotiates.
  void send_test_packet(const StreamRoute& route);

 private:
  static constexpr std::size_t kKept = 16;  // 130 ms at 120 Hz, longer than a client waits before it requests packets

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
  std::mutex mutex_;  // protects the ring
  std::array<Kept, kKept> ring_;
  Kept rehearsed_;
  std::size_t next_ = 0;
};

}  // namespace mocap::sim
