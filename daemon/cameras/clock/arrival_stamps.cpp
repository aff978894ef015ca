#include "cameras/clock/arrival_stamps.h"

#include <arpa/inet.h>
#include <linux/filter.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <span>

namespace mocap::cameras {
namespace {

constexpr std::uint8_t kExtendedIds = 0x80;
constexpr std::size_t kUdpHeader = 8;
constexpr std::uint32_t kSeen_bytes = 128;  // part of a packet that is read: the longest IP header, UDP's, GVSP's

// Attaches a filter that the kernel runs on each packet. The data of a packet begins with the IP header.
bool let_leaders_through(int socket, in_addr camera, std::uint16_t port) {
  sock_filter program[] = {
      BPF_STMT(BPF_LD | BPF_B | BPF_ABS, 9),  // protocol
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, IPPROTO_UDP, 0, 10),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, 12),  // source
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ntohl(camera.s_addr), 0, 8),
      BPF_STMT(BPF_LD | BPF_H | BPF_ABS, 6),  // a later fragment has no header of its own
      BPF_JUMP(BPF_JMP | BPF_JSET | BPF_K, 0x1fff, 6, 0),
      BPF_STMT(BPF_LDX | BPF_B | BPF_MSH, 0),  // length of the IP header
      BPF_STMT(BPF_LD | BPF_H | BPF_IND, 2),   // destination's port
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, port, 0, 3),
      BPF_STMT(BPF_LD | BPF_B | BPF_IND, kUdpHeader + 4),  // GVSP: kind of content
      BPF_STMT(BPF_ALU | BPF_AND | BPF_K, 0x0f),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 1, 1, 0),  // leader
      BPF_STMT(BPF_RET | BPF_K, 0),
      BPF_STMT(BPF_RET | BPF_K, kSeen_bytes),
  };
  const sock_fprog filter{static_cast<unsigned short>(std::size(program)), program};
  return setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter) == 0;
}

std::optional<std::uint16_t> id_of(std::span<const std::uint8_t> packet) {
  if (packet.empty()) return std::nullopt;
  const std::size_t gvsp = std::size_t{packet[0] & 0x0fU} * 4 + kUdpHeader;
  if (packet.size() < gvsp + 16) return std::nullopt;
  // The lowest 16 bits of an extended id of 64 bits are enough, because only the last 64 images are searched.
  const std::size_t at = gvsp + ((packet[gvsp + 4] & kExtendedIds) != 0 ? 14 : 2);
  return static_cast<std::uint16_t>(packet[at] << 8 | packet[at + 1]);
}

Duration stamp_of(msghdr& message) {
  for (cmsghdr* each = CMSG_FIRSTHDR(&message); each != nullptr; each = CMSG_NXTHDR(&message, each)) {
    if (each->cmsg_level != SOL_SOCKET || each->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(each), sizeof stamp);
    return std::chrono::seconds(stamp.tv_sec) + Duration{stamp.tv_nsec};
  }
  return {};
}

}  // namespace

std::unique_ptr<ArrivalStamps> ArrivalStamps::open(in_addr camera, std::uint16_t port) {
  // Protocol 0: the socket receives nothing before the filter is attached.
  const int handle = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (handle < 0) return nullptr;
  std::unique_ptr<ArrivalStamps> stamps(new ArrivalStamps(handle));
  const int yes = 1;
  sockaddr_ll all{};
  all.sll_family = AF_PACKET;
  all.sll_protocol = htons(ETH_P_IP);
  const bool open = let_leaders_through(handle, camera, port) &&
                    setsockopt(handle, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes) == 0 &&
                    bind(handle, reinterpret_cast<const sockaddr*>(&all), sizeof all) == 0;
  return open ? std::move(stamps) : nullptr;
}

ArrivalStamps::~ArrivalStamps() { close(socket_); }

ArrivalStamps::Arrival* ArrivalStamps::find(std::uint16_t id) {
  // If a leader arrived twice, the ring has its first arrival only.
  const auto found =
      std::ranges::find_if(ring_, [id](const Arrival& each) { return each.id == id && each.utc != Duration::zero(); });
  return found == ring_.end() ? nullptr : &*found;
}

void ArrivalStamps::take_in() {
  for (;;) {
    std::array<std::uint8_t, kSeen_bytes> packet;
    alignas(cmsghdr) std::array<std::uint8_t, 128> more;
    iovec place{packet.data(), packet.size()};
    msghdr message{};
    message.msg_iov = &place;
    message.msg_iovlen = 1;
    message.msg_control = more.data();
    message.msg_controllen = more.size();
    const ssize_t size = recvmsg(socket_, &message, 0);
    if (size < 0) return;
    const auto id = id_of(std::span(packet).first(static_cast<std::size_t>(size)));
    if (!id || find(*id) != nullptr) continue;
    ring_[next_] = {*id, stamp_of(message)};
    next_ = (next_ + 1) % kKept;
  }
}

std::optional<Duration> ArrivalStamps::arrival_utc(std::uint64_t frame_id) {
  take_in();
  const Arrival* const found = find(static_cast<std::uint16_t>(frame_id & 0xffff));
  if (found == nullptr) return std::nullopt;
  return found->utc;
}

}  // namespace mocap::cameras
