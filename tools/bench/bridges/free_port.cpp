#include "bench/bridges/free_port.h"

#include <netinet/in.h>
#include <sys/socket.h>

#include "bridges/lib/descriptor.h"
#include "bridges/lib/udp_socket.h"

namespace mocap::bench {
namespace {

bool is_free_for_tcp(std::uint16_t port) {
  const bridge::Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(port);
  return ::bind(socket.number(), reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
}

}  // namespace

Result<std::uint16_t> free_port() {
  constexpr int kAttempts = 100;
  std::string fault = "no port is free for TCP and UDP";
  for (int i = 0; i < kAttempts; ++i) {
    const auto socket = bridge::UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
    if (!socket) break;
    if (is_free_for_tcp(socket->bound().port)) return socket->bound().port;
  }
  return Error{ErrorCode::Io, fault};
}

}  // namespace mocap::bench
