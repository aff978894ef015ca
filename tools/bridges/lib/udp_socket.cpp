#include "bridges/lib/udp_socket.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/errqueue.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace mocap::bridge {
namespace {

constexpr int kPacketsATime = 64;  // so that a flood of requests does not delay the frames
constexpr int kReportsATime = 8;   // failures of earlier packets
// Frames of several receivers until the network card has sent them: ten of 60 kB. The kernel grants at most
// net.core.wmem_max, 208 kB by default.
constexpr int kBuffer_bytes = 1 << 20;

sockaddr_in to_raw(const Peer& peer) {
  sockaddr_in raw{};
  raw.sin_family = AF_INET;
  raw.sin_addr.s_addr = htonl(peer.address);
  raw.sin_port = htons(peer.port);
  return raw;
}

Peer from_raw(const sockaddr_in& raw) { return {ntohl(raw.sin_addr.s_addr), ntohs(raw.sin_port)}; }

const sockaddr* generic(const sockaddr_in& raw) { return reinterpret_cast<const sockaddr*>(&raw); }

}  // namespace

std::string to_string(const Peer& peer) {
  const std::uint32_t a = peer.address;
  return fmt::format("{}.{}.{}.{}:{}", a >> 24U, a >> 16U & 255U, a >> 8U & 255U, a & 255U, peer.port);
}

std::optional<std::uint32_t> read_address(const std::string& text) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return ntohl(address.s_addr);
}

bool has_route(std::uint32_t from, std::uint32_t to) {
  const Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const sockaddr_in own = to_raw({from, 0}), other = to_raw({to, 9});  // any port but 0
  // The kernel looks the route up, and refuses one that leaves the machine from a loopback address.
  return socket && ::bind(socket.number(), generic(own), sizeof own) == 0 &&
         ::connect(socket.number(), generic(other), sizeof other) == 0;
}

std::optional<UdpSocket> UdpSocket::open(const Peer& at, std::string& fault) {
  Descriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_in raw = to_raw(at);
  if (!socket || ::bind(socket.number(), generic(raw), sizeof raw) != 0) {
    fault = fmt::format("UDP {}: {}", to_string(at), std::strerror(errno));
    if (errno == EADDRINUSE) fault += "; another program has this port: end it, or choose another port";
    if (errno == EADDRNOTAVAIL) fault += "; this machine has no such address, see: ip -brief address";
    return std::nullopt;
  }
  const int reports_errors = 1;
  ::setsockopt(socket.number(), IPPROTO_IP, IP_RECVERR, &reports_errors, sizeof reports_errors);
  ::setsockopt(socket.number(), SOL_SOCKET, SO_SNDBUF, &kBuffer_bytes, sizeof kBuffer_bytes);
  return UdpSocket(std::move(socket));
}

bool UdpSocket::send_multicast_from(std::uint32_t address, int hops) {
  const in_addr from{htonl(address)};
  const int to_this_machine = 1;
  const int socket = socket_.number();
  return ::setsockopt(socket, IPPROTO_IP, IP_MULTICAST_IF, &from, sizeof from) == 0 &&
         ::setsockopt(socket, IPPROTO_IP, IP_MULTICAST_TTL, &hops, sizeof hops) == 0 &&
         ::setsockopt(socket, IPPROTO_IP, IP_MULTICAST_LOOP, &to_this_machine, sizeof to_this_machine) == 0;
}

Sent UdpSocket::send(const Peer& to, std::string_view packet) const {
  const sockaddr_in raw = to_raw(to);
  // An earlier packet to another receiver may have failed: each report of that makes one call fail.
  for (int i = 0; i < kReportsATime; ++i) {
    if (::sendto(socket_.number(), packet.data(), packet.size(), MSG_NOSIGNAL, generic(raw), sizeof raw) >= 0) {
      return Sent::Done;
    }
    if (errno == EAGAIN || errno == ENOBUFS || errno == ENOMEM) return Sent::Dropped;
  }
  return Sent::Refused;
}

// Unread reports would fill the buffer of the received packets and wake the caller without end.
void UdpSocket::read_reports(const std::function<void(const Peer&)>& unreachable) const {
  for (int i = 0; i < kPacketsATime; ++i) {
    sockaddr_in raw{};
    std::array<char, 512> control;
    msghdr message{};
    message.msg_name = &raw;  // the receiver of the packet that failed
    message.msg_namelen = sizeof raw;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (::recvmsg(socket_.number(), &message, MSG_ERRQUEUE) < 0) return;
    for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
      if (part->cmsg_level != IPPROTO_IP || part->cmsg_type != IP_RECVERR) continue;
      sock_extended_err error{};
      std::memcpy(&error, CMSG_DATA(part), sizeof error);
      if (error.ee_errno == ECONNREFUSED) unreachable(from_raw(raw));
    }
  }
}

void UdpSocket::receive(const std::function<void(const Peer& from, std::string_view packet)>& take,
                        const std::function<void(const Peer&)>& unreachable) {
  read_reports(unreachable);
  for (int i = 0; i < kPacketsATime; ++i) {
    sockaddr_in raw{};
    socklen_t size = sizeof raw;
    const auto count =
        ::recvfrom(socket_.number(), packet_.data(), packet_.size(), 0, reinterpret_cast<sockaddr*>(&raw), &size);
    if (count < 0 && errno != EAGAIN) continue;  // the report of an earlier failure, or a signal
    if (count < 0) return;
    take(from_raw(raw), {packet_.data(), static_cast<std::size_t>(count)});
  }
}

Peer UdpSocket::bound() const {
  sockaddr_in raw{};
  socklen_t size = sizeof raw;
  ::getsockname(socket_.number(), reinterpret_cast<sockaddr*>(&raw), &size);
  return from_raw(raw);
}

}  // namespace mocap::bridge
