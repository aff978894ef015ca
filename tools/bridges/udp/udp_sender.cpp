#include "bridges/udp/udp_sender.h"

#ifdef _WIN32
#include <winsock2.h>
#include <ws2tcpip.h>
#else
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#endif

#include <cstddef>
#include <utility>

namespace mocap::bridge {
namespace {

#ifdef _WIN32
using Handle = SOCKET;
constexpr Handle kNone = INVALID_SOCKET;
using Size = int;  // of a packet
constexpr int kCloseOnExec = 0;
constexpr int kNoSignal = 0;
void close_socket(Handle handle) { ::closesocket(handle); }

// The library of sockets, in use as long as this object exists.
struct Sockets {
  WSADATA data{};
  Sockets() { ::WSAStartup(MAKEWORD(2, 2), &data); }
  Sockets(const Sockets&) = delete;
  Sockets& operator=(const Sockets&) = delete;
  ~Sockets() { ::WSACleanup(); }
};
#else
using Handle = int;
constexpr Handle kNone = -1;
using Size = std::size_t;
constexpr int kCloseOnExec = SOCK_CLOEXEC;
constexpr int kNoSignal = MSG_NOSIGNAL;
void close_socket(Handle handle) { ::close(handle); }

struct Sockets {};
#endif

Handle connected(const addrinfo& at) {
  const Handle handle = ::socket(at.ai_family, at.ai_socktype | kCloseOnExec, at.ai_protocol);
  if (handle == kNone) return kNone;
  if (::connect(handle, at.ai_addr, static_cast<socklen_t>(at.ai_addrlen)) == 0) return handle;
  close_socket(handle);
  return kNone;
}

bool is_loopback(const addrinfo& at) {
  if (at.ai_family == AF_INET6) {
    return IN6_IS_ADDR_LOOPBACK(&reinterpret_cast<const sockaddr_in6*>(at.ai_addr)->sin6_addr) != 0;
  }
  constexpr unsigned kLoopbackNet = 127;
  return at.ai_family == AF_INET &&
         ntohl(reinterpret_cast<const sockaddr_in*>(at.ai_addr)->sin_addr.s_addr) >> 24U == kLoopbackNet;
}

}  // namespace

struct UdpSender::Impl {
  Sockets sockets;
  Handle handle = kNone;
  bool local = false;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (handle != kNone) close_socket(handle);
  }
};

UdpSender::UdpSender(std::unique_ptr<Impl> impl, std::string name) : impl_(std::move(impl)), name_(std::move(name)) {}
UdpSender::~UdpSender() = default;

std::unique_ptr<UdpSender> UdpSender::open(const std::string& host, const std::string& port, std::string& fault) {
  auto impl = std::make_unique<Impl>();
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), port.c_str(), &hints, &found); error != 0) {
    fault = ::gai_strerror(error);
    return nullptr;
  }
  // IPv4 first: a name as localhost often has both, and most receivers listen at IPv4 alone.
  for (const int family : {AF_INET, AF_INET6}) {
    for (const addrinfo* at = found; at != nullptr && impl->handle == kNone; at = at->ai_next) {
      if (at->ai_family != family) continue;
      impl->handle = connected(*at);
      impl->local = is_loopback(*at);
    }
  }
  ::freeaddrinfo(found);
  if (impl->handle == kNone) {
    fault = "cannot be reached";
    return nullptr;
  }
  return std::unique_ptr<UdpSender>(new UdpSender(std::move(impl), host + ":" + port));
}

bool UdpSender::send(std::string_view packet) {
  const auto sent = ::send(impl_->handle, packet.data(), static_cast<Size>(packet.size()), kNoSignal);
  return sent >= 0 && static_cast<std::size_t>(sent) == packet.size();
}

bool UdpSender::is_local() const { return impl_->local; }

}  // namespace mocap::bridge
