#include "gvsp_stream.h"

#include <sched.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

namespace mocap::sim {
namespace {

constexpr std::uint32_t kHeaders = 20 + 8 + 8;  // IP, UDP and GVSP headers, which are part of the packet size
constexpr std::size_t kBatch = 16;              // packets for one system call
constexpr std::uint32_t kLeader = 1, kTrailer = 2, kPayload = 3;
constexpr std::uint16_t kImage = 1, kWithChunks = 0x4000;  // payload type

void put16(std::byte* at, std::uint16_t value) {
  const std::uint16_t net = htons(value);
  std::memcpy(at, &net, sizeof net);
}
void put32(std::byte* at, std::uint32_t value) {
  const std::uint32_t net = htonl(value);
  std::memcpy(at, &net, sizeof net);
}

// The GVSP header of a packet, or a complete leader or trailer.
struct Head {
  std::array<std::byte, 44> bytes{};
  std::size_t size = 8;
};

Head head_of(const ServedImage& image, std::uint32_t packet, std::uint32_t last) {
  Head head;
  const std::uint32_t content = packet == 0 ? kLeader : packet == last ? kTrailer : kPayload;
  const auto payload = static_cast<std::uint16_t>(image.chunks ? kImage | kWithChunks : kImage);
  put16(&head.bytes[2], image.id);
  put32(&head.bytes[4], content << 24 | packet);
  if (content == kLeader) {
    put16(&head.bytes[10], payload);
    put32(&head.bytes[12], static_cast<std::uint32_t>(image.stamp_ns >> 32));
    put32(&head.bytes[16], static_cast<std::uint32_t>(image.stamp_ns));
    const std::uint32_t infos[] = {image.pixel_format, image.width, image.height, image.left, image.top};
    for (std::size_t i = 0; i < 5; ++i) put32(&head.bytes[20 + 4 * i], infos[i]);
    head.size = 44;
  } else if (content == kTrailer) {
    put16(&head.bytes[10], payload);
    put32(&head.bytes[12], image.height);
    head.size = 16;
  }
  return head;
}

// Collects packets and sends them with one system call.
class Batch {
 public:
  Batch(int socket, const sockaddr_in& to) : socket_(socket), to_(to) {}

  bool full() const { return count_ == kBatch; }

  void add(const Head& head, std::span<const std::byte> data) {
    heads_[count_] = head;
    parts_[count_] = {{{heads_[count_].bytes.data(), head.size}, {const_cast<std::byte*>(data.data()), data.size()}}};
    msghdr& message = messages_[count_].msg_hdr;
    message = {};
    message.msg_name = &to_;
    message.msg_namelen = sizeof to_;
    message.msg_iov = parts_[count_].data();
    message.msg_iovlen = data.empty() ? 1 : 2;
    ++count_;
  }

  void send() {
    // A packet that the system refuses counts as lost on the network.
    if (count_ > 0) sendmmsg(socket_, messages_.data(), static_cast<unsigned>(count_), 0);
    count_ = 0;
  }

 private:
  int socket_;
  sockaddr_in to_;
  std::array<Head, kBatch> heads_;
  std::array<std::array<iovec, 2>, kBatch> parts_{};
  std::array<mmsghdr, kBatch> messages_{};
  std::size_t count_ = 0;
};

// Sleeps, then polls the clock: the kernel wakes a sleeping thread some tens of microseconds late, more than the
// distance of packets.
void wait_until(Timestamp at) {
  constexpr Duration kWaking = std::chrono::microseconds(80);
  const Duration left = at - host_now();
  if (left > kWaking) {
    const Duration sleep = left - kWaking;
    const timespec time{sleep.count() / 1'000'000'000, sleep.count() % 1'000'000'000};
    nanosleep(&time, nullptr);
  }
  while (host_now() < at) continue;
}

}  // namespace

GvspStream::GvspStream(double lost_share, std::uint64_t seed) : lost_share_(lost_share), seed_(seed) {}

GvspStream::~GvspStream() {
  if (socket_ >= 0) close(socket_);
}

bool GvspStream::open(in_addr from) {
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = from;
  const int room = 4 << 20;
  if (socket_ >= 0) setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &room, sizeof room);
  const int whole = IP_PMTUDISC_DO;  // do not fragment, so that a client that negotiates the packet size detects
                                     // packets that are too large
  if (socket_ >= 0) setsockopt(socket_, IPPROTO_IP, IP_MTU_DISCOVER, &whole, sizeof whole);
  socklen_t length = sizeof own_;
  return socket_ >= 0 && bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
         getsockname(socket_, reinterpret_cast<sockaddr*>(&own_), &length) == 0;
}

std::uint32_t GvspStream::Kept::payload_bytes() const { return std::max(route.packet_bytes, kHeaders + 64) - kHeaders; }

std::uint32_t GvspStream::Kept::last_packet() const {
  return static_cast<std::uint32_t>((payload.size() + payload_bytes() - 1) / payload_bytes()) + 1;
}

std::span<std::byte> GvspStream::room(std::size_t bytes) {
  const std::scoped_lock lock(mutex_);
  next_ = (next_ + 1) % kKept;
  Kept& kept = ring_[next_];
  kept.whole = false;
  kept.payload.resize(bytes);
  return kept.payload;
}

void GvspStream::send(const ServedImage& image, std::span<const std::byte> behind, const StreamRoute& route) {
  const Kept* kept = nullptr;
  {
    const std::scoped_lock lock(mutex_);
    Kept& filled = ring_[next_];
    if (!filled.whole) filled.payload.insert(filled.payload.end(), behind.begin(), behind.end());
    filled.image = image;
    filled.route = route;
    filled.whole = true;
    kept = &filled;
  }
  // No lock: only this thread changes the ring, in room().
  // Real cameras have separate links. The yield after the leader lets the threads of the other cameras start their
  // images.
  transmit(*kept, 0, 0);
  sched_yield();
  transmit(*kept, 1, kept->last_packet());
}

void GvspStream::rehearse(const ServedImage& image, const StreamRoute& route) {
  rehearsed_.image = image;
  rehearsed_.route = route;
  rehearsed_.route.to = own_;
  transmit(rehearsed_, 0, 0);
  std::array<std::byte, 64> nothing;
  recv(socket_, nothing.data(), nothing.size(), MSG_DONTWAIT);
}

void GvspStream::resend(std::uint16_t id, std::uint32_t first, std::uint32_t last) {
  const std::scoped_lock lock(mutex_);
  for (const Kept& kept : ring_) {
    if (kept.whole && kept.image.id == id) return transmit(kept, first, std::min(last, kept.last_packet()));
  }
}

void GvspStream::transmit(const Kept& kept, std::uint32_t first, std::uint32_t last) {
  std::mt19937_64 random(seed_ * 1'000'003 + ++sendings_);  // one generator for each call, because two threads may send
  std::bernoulli_distribution lost(lost_share_);
  Batch batch(socket_, kept.route.to);
  // Each packet has its own departure time. A late packet does not delay the following packets.
  const Duration delay = kept.route.packet_delay;
  Timestamp leaves_at = delay > Duration::zero() ? host_now() : Timestamp{};
  for (std::uint32_t packet = first; packet <= last; ++packet) {
    if (lost_share_ > 0.0 && lost(random)) continue;
    std::span<const std::byte> data;
    if (packet > 0 && packet < kept.last_packet()) {
      const std::size_t begin = std::size_t{packet - 1} * kept.payload_bytes();
      data = std::span(kept.payload)
                 .subspan(begin, std::min<std::size_t>(kept.payload_bytes(), kept.payload.size() - begin));
    }
    batch.add(head_of(kept.image, packet, kept.last_packet()), data);
    if (delay <= Duration::zero() && !batch.full()) continue;
    if (delay > Duration::zero()) wait_until(leaves_at);
    leaves_at += delay;
    batch.send();
  }
  batch.send();
}

void GvspStream::send_test_packet(const StreamRoute& route) {
  const std::vector<std::byte> bytes(std::max(route.packet_bytes, kHeaders) - 28);
  sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&route.to), sizeof route.to);
}

}  // namespace mocap::sim
