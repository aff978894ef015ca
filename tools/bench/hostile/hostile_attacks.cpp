#include "bench/hostile/hostile_attacks.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>
#include <zmq.h>

#include <cerrno>
#include <cstring>
#include <random>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "wire/zmq_socket.h"

namespace mocap::bench {
namespace {

using std::chrono::milliseconds;

// A TCP connection to the feed that can send arbitrary bytes.
class Tcp {
 public:
  explicit Tcp(std::uint16_t port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{0, 200'000};  // limit for a blocked send or a missing answer
    ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof(patience));
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    open_ = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  }
  Tcp(Tcp&& other) noexcept : socket_(std::exchange(other.socket_, -1)), open_(other.open_) {}
  Tcp(const Tcp&) = delete;
  Tcp& operator=(const Tcp&) = delete;
  ~Tcp() {
    if (socket_ >= 0) ::close(socket_);
  }

  bool open() const { return open_; }
  // Returns false once the peer has closed the connection.
  bool send(std::string_view bytes) {
    while (open_ && !bytes.empty()) {
      const ssize_t sent = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return open_ = false;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
    return open_;
  }
  // Sends the greeting and the READY command of a SUB socket without security (RFC 23, ZMTP 3.0) and reads the answers.
  // A peer that sends more before the answers is disconnected before the attack.
  bool greet() {
    std::string greeting("\xff\0\0\0\0\0\0\0\1\x7f\3\0NULL", 16);
    greeting.resize(64, '\0');
    const std::string_view ready("\4\x19\5READY\xbSocket-Type\0\0\0\3SUB", 27);
    return send(greeting) && take(64) && send(ready) && take(28);
  }

 private:
  bool take(std::size_t count) {
    char bytes[64];
    return open_ = ::recv(socket_, bytes, count, MSG_WAITALL) == static_cast<ssize_t>(count);
  }

  int socket_;
  bool open_ = false;
};

class Stalled final : public Attack {
 public:
  Stalled(std::uint16_t port, Duration pause) : pause_(pause) {
    const std::string endpoint = "tcp://127.0.0.1:" + std::to_string(port);
    static_cast<void>(socket_.open(context_, ZMQ_SUB, endpoint));
    for (const auto& [option, value] : {std::pair{ZMQ_RCVHWM, 1}, {ZMQ_RCVBUF, 4096}, {ZMQ_LINGER, 0}}) {
      static_cast<void>(socket_.set(option, value));
    }
    static_cast<void>(socket_.set(ZMQ_SUBSCRIBE, std::string_view{}));
    zmq_connect(socket_.get(), endpoint.c_str());
  }
  void go_on(Timestamp until) override {
    while (host_now() < until) {
      std::this_thread::sleep_for(pause_);
      if (pause_ < milliseconds(1000)) message_.receive(socket_);
    }
  }

 private:
  Duration pause_;
  wire::ZmqContext context_;
  wire::ZmqSocket socket_;
  wire::ZmqMessage message_;
};

// Sends one subscription of 256 MiB, repeatedly because the feed closes the connection.
class HugeSubscription final : public Attack {
 public:
  explicit HugeSubscription(std::uint16_t port) : port_(port) {}
  void go_on(Timestamp until) override {
    const std::string head("\2\0\0\0\0\x10\0\0\0\1", 10);  // header of a long frame of 256 MiB with a subscription
    const std::string piece(1 << 20, 'x');
    while (host_now() < until) {
      Tcp tcp(port_);
      if (!tcp.open() || !tcp.greet() || !tcp.send(head)) continue;
      for (int i = 0; i < 256 && host_now() < until && tcp.send(piece); ++i) {
      }
    }
  }

 private:
  std::uint16_t port_;
};

class ManySubscriptions final : public Attack {
 public:
  explicit ManySubscriptions(std::uint16_t port) : port_(port) {}
  void go_on(Timestamp until) override {
    constexpr int kAll = 300'000;
    int sent = 0;
    while (host_now() < until && sent < kAll) {
      Tcp tcp(port_);
      if (!tcp.open() || !tcp.greet()) continue;
      bool taken = true;
      while (taken && sent < kAll && host_now() < until) {
        std::string some;
        for (int i = 0; i < 500; ++i, ++sent) {
          const std::string topic = "topic" + std::to_string(sent);
          some += '\0';
          some += static_cast<char>(topic.size() + 1);
          some += '\1' + topic;
        }
        taken = tcp.send(some);
      }
      if (sent >= kAll) {
        const Timestamp rest = std::min(until, host_now() + milliseconds(1500));
        while (host_now() < rest)
          std::this_thread::sleep_for(milliseconds(10));  // keep the connection with all subscriptions
      }
    }
  }

 private:
  std::uint16_t port_;
};

class RandomBytes final : public Attack {
 public:
  RandomBytes(std::uint16_t port, std::uint64_t seed) : port_(port), random_(seed) {}
  void go_on(Timestamp until) override {
    while (host_now() < until) {
      Tcp tcp(port_);
      const bool greets = random_() % 2 == 0;
      if (greets && !tcp.greet()) continue;
      std::string bytes(1 + random_() % 65536, '\0');
      for (char& byte : bytes) byte = static_cast<char>(random_());
      tcp.send(bytes);
    }
  }

 private:
  std::uint16_t port_;
  std::mt19937_64 random_;
};

// 2,000 connections that never send a byte.
class HalfOpen final : public Attack {
 public:
  explicit HalfOpen(std::uint16_t port) : port_(port) {}
  void go_on(Timestamp until) override {
    while (host_now() < until) {
      if (connections_.size() < 2000) {
        connections_.emplace_back(port_);
      } else {
        std::this_thread::sleep_for(milliseconds(10));
      }
    }
  }

 private:
  std::uint16_t port_;
  std::vector<Tcp> connections_;
};

}  // namespace

std::unique_ptr<Attack> make_attack(const std::string& name, std::uint16_t port, std::uint64_t seed) {
  if (name == "stalled") return std::make_unique<Stalled>(port, milliseconds(1000));
  if (name == "slow") return std::make_unique<Stalled>(port, milliseconds(300));
  if (name == "huge_subscription") return std::make_unique<HugeSubscription>(port);
  if (name == "many_subscriptions") return std::make_unique<ManySubscriptions>(port);
  if (name == "random_bytes") return std::make_unique<RandomBytes>(port, seed);
  return std::make_unique<HalfOpen>(port);
}

}  // namespace mocap::bench
