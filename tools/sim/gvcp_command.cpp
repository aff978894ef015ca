#include "gvcp_command.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <ctime>

#include "base/time.h"

namespace mocap::sim {
namespace {

constexpr std::uint8_t kGvcpKey = 0x42;
constexpr std::size_t kGvcpHeader = 8;

std::int64_t received_utc_ns(msghdr& message) {
  for (cmsghdr* each = CMSG_FIRSTHDR(&message); each != nullptr; each = CMSG_NXTHDR(&message, each)) {
    if (each->cmsg_level != SOL_SOCKET || each->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(each), sizeof stamp);
    return stamp.tv_sec * 1'000'000'000 + stamp.tv_nsec;
  }
  return utc_now_ns();
}

}  // namespace

std::int64_t utc_now_ns() { return to_ns(host_now()) + utc_minus_host().count(); }

void GvcpCommand::acknowledge(std::span<const std::uint8_t> payload, std::uint16_t status) const {
  std::array<std::uint8_t, 600> packet{};
  put16(&packet[0], status);
  put16(&packet[2], command + 1U);
  put16(&packet[4], static_cast<std::uint32_t>(payload.size()));
  put16(&packet[6], request);
  std::copy(payload.begin(), payload.end(), packet.begin() + kGvcpHeader);
  sendto(socket, packet.data(), kGvcpHeader + payload.size(), 0, reinterpret_cast<const sockaddr*>(&from), sizeof from);
}

int bound_gvcp_socket(in_addr address, bool shared) {
  const int handle = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (handle < 0) return -1;
  const int yes = 1;
  setsockopt(handle, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  if (shared) setsockopt(handle, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  setsockopt(handle, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_port = htons(kGvcpPort);
  name.sin_addr = address;
  if (bind(handle, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0) return handle;
  close(handle);
  return -1;
}

std::optional<GvcpCommand> receive_gvcp(int socket, std::array<std::uint8_t, kMaxGvcpBytes>& packet) {
  GvcpCommand command;
  command.socket = socket;
  alignas(cmsghdr) std::array<std::uint8_t, 128> more;
  iovec place{packet.data(), packet.size()};
  msghdr message{};
  message.msg_name = &command.from;
  message.msg_namelen = sizeof command.from;
  message.msg_iov = &place;
  message.msg_iovlen = 1;
  message.msg_control = more.data();
  message.msg_controllen = more.size();
  const ssize_t size = recvmsg(socket, &message, 0);
  if (size < static_cast<ssize_t>(kGvcpHeader) || packet[0] != kGvcpKey ||
      get16(&packet[4]) + static_cast<ssize_t>(kGvcpHeader) > size) {
    return std::nullopt;
  }
  command.arrived_utc_ns = received_utc_ns(message);
  command.flags = packet[1];
  command.command = get16(&packet[2]);
  command.request = get16(&packet[6]);
  command.data = std::span<const std::uint8_t>(packet).subspan(kGvcpHeader, get16(&packet[4]));
  return command;
}

}  // namespace mocap::sim
