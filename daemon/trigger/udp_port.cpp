#include "trigger/udp_port.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "trigger/ip4.h"
#include "trigger/request.h"

namespace mocap::trigger {
namespace {

sockaddr_in to_system(const Peer& peer) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(peer.address);
  address.sin_port = htons(peer.port);
  return address;
}

Error cannot_listen(const Peer& at, int number) {
  const std::string what = fmt::format("[trigger] cannot listen on {} UDP port {}: {}", address_text(at.address),
                                       at.port, std::strerror(number));  // NOLINT(concurrency-mt-unsafe)
  if (number == EADDRINUSE) return {ErrorCode::Busy, what + "; end the program that uses it, or change the port"};
  if (number == EADDRNOTAVAIL) return {ErrorCode::NotFound, what + "; listen must be an address of this machine"};
  if (number == EACCES) return {ErrorCode::Io, what + "; use a port from 1024, or grant CAP_NET_BIND_SERVICE"};
  return {ErrorCode::Io, what};
}

class Socket {
 public:
  static Result<Socket> open(const Peer& at) {
    Socket socket(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    if (socket.number_ < 0) return cannot_listen(at, errno);
    const int yes = 1;  // a receiver may be the broadcast address of a network
    static_cast<void>(::setsockopt(socket.number_, SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes));
    const sockaddr_in address = to_system(at);
    if (::bind(socket.number_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
      return cannot_listen(at, errno);
    }
    return socket;
  }
  explicit Socket(int number) : number_(number) {}
  Socket(Socket&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  ~Socket() {
    if (number_ >= 0) ::close(number_);
  }

  int number() const { return number_; }

 private:
  int number_;
};

class UdpPort final : public DatagramPort {
 public:
  explicit UdpPort(std::vector<Socket> sockets) : sockets_(std::move(sockets)), bytes_(kMaxPacket_bytes) {
    for (const Socket& socket : sockets_) polled_.push_back({socket.number(), POLLIN, 0});
    polled_.push_back({-1, POLLIN, 0});  // wake
  }

  std::optional<Datagram> next(int wake, Duration patience) override {
    polled_.back().fd = wake;
    const auto patience_ms = std::chrono::ceil<std::chrono::milliseconds>(patience).count();
    if (::poll(polled_.data(), polled_.size(), static_cast<int>(patience_ms)) <= 0) return std::nullopt;
    // Begins after the socket of the last datagram, so that a flooded socket does not silence the others.
    for (std::size_t i = 1; i <= sockets_.size(); ++i) {
      const std::size_t socket = (last_ + i) % sockets_.size();
      if (polled_[socket].revents == 0) continue;
      if (auto datagram = receive(socket)) {
        last_ = socket;
        return datagram;
      }
    }
    return std::nullopt;
  }

  void send(const Datagram& datagram) override {
    MOCAP_EXPECTS(datagram.socket < sockets_.size());
    const sockaddr_in to = to_system(datagram.peer);
    static_cast<void>(::sendto(sockets_[datagram.socket].number(), datagram.bytes.data(), datagram.bytes.size(),
                               MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to), sizeof to));
  }

 private:
  // An error of the socket (a port that nobody listens on) ends here, too: the read clears it.
  std::optional<Datagram> receive(std::size_t socket) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t received = ::recvfrom(sockets_[socket].number(), bytes_.data(), bytes_.size(), MSG_TRUNC,
                                        reinterpret_cast<sockaddr*>(&from), &size);
    if (received < 0) return std::nullopt;
    const auto whole = static_cast<std::size_t>(received);
    Datagram datagram;
    datagram.socket = socket;
    datagram.peer = {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
    datagram.bytes.assign(bytes_.data(), std::min(whole, bytes_.size()));
    datagram.cut = whole > bytes_.size();
    return datagram;
  }

  std::vector<Socket> sockets_;
  std::vector<pollfd> polled_;  // of each socket, and wake
  std::vector<char> bytes_;
  std::size_t last_ = 0;
};

}  // namespace

Result<std::unique_ptr<DatagramPort>> open_udp_port(const TriggerSettings& settings) {
  const std::uint32_t listen = read_address(settings.listen).value_or(INADDR_ANY);
  std::vector<Socket> sockets;
  for (const SocketUse& use : sockets_of(settings)) {
    Result<Socket> socket = Socket::open({listen, static_cast<std::uint16_t>(use.port)});
    if (!socket) return socket.error();
    sockets.push_back(std::move(*socket));
  }
  return std::unique_ptr<DatagramPort>(std::make_unique<UdpPort>(std::move(sockets)));
}

Status try_udp_ports(const TriggerSettings& settings, const TriggerSettings& before) {
  const std::uint32_t listen = read_address(settings.listen).value_or(INADDR_ANY);
  const std::vector<SocketUse> own = sockets_of(before);
  for (const SocketUse& use : sockets_of(settings)) {
    const bool is_own = std::ranges::find(own, use.port, &SocketUse::port) != own.end();
    const Result<Socket> tried = Socket::open({listen, static_cast<std::uint16_t>(is_own ? 0 : use.port)});
    if (!tried) return tried.error();
  }
  return {};
}

}  // namespace mocap::trigger
