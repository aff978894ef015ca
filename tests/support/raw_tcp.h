#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace mocap::support {

/// A TCP connection to a loopback port, over which a test sends arbitrary bytes.
class RawTcp {
 public:
  /// `endpoint`: tcp://127.0.0.1:PORT. The receive buffer is small, so that the sender soon notices a stalled test.
  explicit RawTcp(const std::string& endpoint) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(endpoint.substr(endpoint.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int small_bytes = 4096;
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &small_bytes, sizeof(small_bytes));
    open_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  }
  RawTcp(const RawTcp&) = delete;
  RawTcp& operator=(const RawTcp&) = delete;
  ~RawTcp() { ::close(socket_); }

  /// Ends the connection with RST: the peer's unread data and unsent data are lost.
  void reset() {
    const linger none{1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &none, sizeof(none));
    ::close(std::exchange(socket_, -1));
    open_ = false;
  }

  bool open() const { return open_; }
  void send(std::string_view bytes) {
    open_ = open_ && ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  /// Performs the handshake of a SUB socket without security (RFC 23, ZMTP 3.0): greeting and READY. Waits for the
  /// peer's READY, because the peer may reject earlier messages.
  void subscribe_to_nothing_yet() {
    std::string greeting("\xff\0\0\0\0\0\0\0\1\x7f\3\0NULL", 16);
    greeting.resize(64, '\0');
    send(greeting);
    take(64);
    send({"\4\x19\5READY\xbSocket-Type\0\0\0\3SUB", 27});
    take(28);  // READY of an XPUB socket
  }
  /// Returns the received bytes without waiting; open() is false after the peer closed the connection.
  std::string receive() {
    char bytes[4096];
    const ssize_t count = ::recv(socket_, bytes, sizeof(bytes), MSG_DONTWAIT);
    if (count == 0 || (count < 0 && errno != EAGAIN)) open_ = false;
    return count > 0 ? std::string(bytes, static_cast<std::size_t>(count)) : std::string();
  }

 private:
  void take(std::size_t count) {
    char bytes[64];
    open_ = open_ && ::recv(socket_, bytes, count, MSG_WAITALL) == static_cast<ssize_t>(count);
  }

  int socket_;
  bool open_ = false;
};

}  // namespace mocap::support
