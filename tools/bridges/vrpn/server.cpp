#include "bridges/vrpn/server.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>

#include "bridges/lib/feed_source.h"

namespace mocap::vrpn {
namespace {

using bridge::Descriptor;
using bridge::monotonic_ns;
using bridge::Peer;

constexpr std::string_view kProgram = "mocap-vrpn";
constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kGreeting_ns =
    5 * kSecond_ns;  // for the connection and the cookie; VRPN's clients need 2 at most
constexpr std::int64_t kStalled_ns = 10 * kSecond_ns;  // a client that reads nothing for this time is closed
constexpr int kSilent_ms = 60'000;                     // a client whose machine is gone is closed after this time

std::int64_t unix_now_ns() {
  return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
}

std::int64_t exposure_unix_ns(const ClientFrame& frame) {
  const mocap_frame_info info = frame.info();
  if (info.exposed_at_ns == MOCAP_ABSENT || info.utc_minus_host_ns == MOCAP_ABSENT) return unix_now_ns();
  return info.exposed_at_ns + info.utc_minus_host_ns;
}

sockaddr_in to_raw(const Peer& peer) {
  sockaddr_in raw{};
  raw.sin_family = AF_INET;
  raw.sin_addr.s_addr = htonl(peer.address);
  raw.sin_port = htons(peer.port);
  return raw;
}

void set_option(const Descriptor& socket, int level, int name, int value) {
  ::setsockopt(socket.number(), level, name, &value, sizeof value);
}

// Sends small messages at once, and notices the end of a machine that does not say so.
void configure(const Descriptor& socket) {
  constexpr int kIdle_s = 30;
  constexpr int kInterval_s = 10;
  set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, kIdle_s);
  set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, kInterval_s);
  set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, kSilent_ms);
}

}  // namespace

struct Server::Connection {
  Descriptor socket;
  Peer peer;
  bool connected;  // false: the server calls back, and the client has not accepted yet
  Session session;
  std::int64_t opened_ns = monotonic_ns();
  std::int64_t progress_ns = opened_ns;  // last time that the client read something
  bool waits_for_room = false;
  bool closed = false;
  std::uint64_t pings = 0;
  std::uint64_t dropped = 0;
};

Server::Server(const ServerOptions& options, bridge::Statistics& statistics)
    : options_(options), statistics_(statistics), senders_(options.offer) {}

Server::~Server() = default;

std::string Server::open(bridge::EventLoop& loop) {
  loop_ = &loop;
  if (const std::string fault = listen(); !fault.empty()) return fault;
  std::string fault;
  udp_ = bridge::UdpSocket::open(options_.at, fault);
  if (!udp_) return fault;
  loop.watch(listener_.number(), EPOLLIN, [this](std::uint32_t /*events*/) { accept_client(); });
  loop.watch(udp_->descriptor(), EPOLLIN, [this](std::uint32_t /*events*/) {
    udp_->receive([this](const Peer& from, std::string_view packet) { take_request(from, packet); },
                  [this](const Peer& peer) { close_unreachable(peer); });
    remove_closed();
  });
  bridge::say(kProgram, fmt::format("serves TCP and UDP at {}", to_string(options_.at)));
  bridge::warn_if_open(kProgram, "VRPN", options_.at.address);
  return {};
}

// Sets the port in options_ if the kernel chooses it.
std::string Server::listen() {
  constexpr int kWaiting = 16;
  listener_ = Descriptor(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  set_option(listener_, SOL_SOCKET, SO_REUSEADDR, 1);
  sockaddr_in raw = to_raw(options_.at);
  socklen_t size = sizeof raw;
  auto* const generic = reinterpret_cast<sockaddr*>(&raw);
  if (!listener_ || ::bind(listener_.number(), generic, size) != 0 || ::listen(listener_.number(), kWaiting) != 0) {
    std::string fault = fmt::format("TCP {}: {}", to_string(options_.at), std::strerror(errno));
    if (errno == EADDRINUSE) fault += "; another program has this port: end it, or choose another port with --port";
    return fault;
  }
  ::getsockname(listener_.number(), generic, &size);
  options_.at.port = ntohs(raw.sin_port);
  return {};
}

void Server::accept_client() {
  sockaddr_in raw{};
  socklen_t size = sizeof raw;
  Descriptor socket(
      ::accept4(listener_.number(), reinterpret_cast<sockaddr*>(&raw), &size, SOCK_CLOEXEC | SOCK_NONBLOCK));
  if (socket) add(std::move(socket), {ntohl(raw.sin_addr.s_addr), ntohs(raw.sin_port)}, true);
}

void Server::take_request(const Peer& from, std::string_view packet) {
  const auto port = callback_port(packet);
  port ? ++statistics_.requests : ++statistics_.invalid;
  if (port) call_back({from.address, *port});
}

// A client repeats its request each second until it is called.
void Server::call_back(const Peer& client) {
  const auto same = [&](const auto& entry) { return entry.second->peer == client; };
  if (std::any_of(clients_.begin(), clients_.end(), same)) return;
  Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_in raw = to_raw(client);
  const int done = ::connect(socket.number(), reinterpret_cast<const sockaddr*>(&raw), sizeof raw);
  if (done != 0 && errno != EINPROGRESS) return;
  add(std::move(socket), client, false);
}

void Server::add(Descriptor socket, const Peer& peer, bool connected) {
  if (clients_.size() >= kMaxClients) {
    bridge::say(kProgram,
                fmt::format("{} refused: {} clients are served, which is the maximum", to_string(peer), kMaxClients));
    return;
  }
  configure(socket);
  const int number = socket.number();
  auto client = std::make_unique<Connection>(
      Connection{.socket = std::move(socket), .peer = peer, .connected = connected, .session = Session(senders_)});
  Connection* const raw = client.get();
  clients_[number] = std::move(client);
  loop_->watch(number, connected ? EPOLLIN : EPOLLOUT, [this, raw](std::uint32_t events) {
    serve(*raw, events);
    remove_closed();
  });
  if (connected) flush(*raw);
}

void Server::serve(Connection& client, std::uint32_t events) {
  if (!client.connected) {
    finish_connecting(client);
    if (!client.connected) return;
  }
  if ((events & (EPOLLIN | EPOLLHUP | EPOLLERR)) != 0) receive(client);
  if (!client.closed) flush(client);
}

void Server::finish_connecting(Connection& client) {
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(client.socket.number(), SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) {
    close(client, fmt::format("cannot be called back: {}", std::strerror(error)));
    return;
  }
  client.connected = true;
  loop_->change(client.socket.number(), EPOLLIN);
}

void Server::receive(Connection& client) {
  std::array<char, 65536> bytes;
  const auto count = ::recv(client.socket.number(), bytes.data(), bytes.size(), 0);
  if (count == 0) return close(client, "closed the connection");
  if (count < 0) {
    if (errno != EAGAIN && errno != EINTR) close(client, std::strerror(errno));
    return;
  }
  const bool goes_on = client.session.take({bytes.data(), static_cast<std::size_t>(count)}, unix_now_ns());
  statistics_.requests += client.session.pings() - std::exchange(client.pings, client.session.pings());
  if (goes_on) return;
  ++statistics_.invalid;
  close(client, client.session.fault());
}

void Server::flush(Connection& client) {
  send_datagrams(client);
  statistics_.dropped += client.session.dropped() - std::exchange(client.dropped, client.session.dropped());
  std::string& output = client.session.output();
  if (!client.connected) return;
  if (!output.empty()) {
    const auto count = ::send(client.socket.number(), output.data(), output.size(), MSG_NOSIGNAL);
    if (count < 0 && errno != EAGAIN && errno != EINTR) return close(client, std::strerror(errno));
    if (count > 0) {
      ++statistics_.sent;
      statistics_.bytes += static_cast<std::uint64_t>(count);
      output.erase(0, static_cast<std::size_t>(count));
      client.progress_ns = monotonic_ns();
    }
  } else {
    client.progress_ns = monotonic_ns();
  }
  if (client.waits_for_room == output.empty()) {
    client.waits_for_room = !output.empty();
    loop_->change(client.socket.number(), client.waits_for_room ? EPOLLIN | EPOLLOUT : EPOLLIN);
  }
}

void Server::send_datagrams(Connection& client) {
  for (const std::string& datagram : client.session.datagrams()) {
    if (udp_->send({client.peer.address, client.session.udp_port().value_or(0)}, datagram) != bridge::Sent::Done) {
      ++statistics_.dropped;
      continue;
    }
    ++statistics_.sent;
    statistics_.bytes += datagram.size();
  }
  client.session.datagrams().clear();
}

void Server::take(const ClientFrame& frame, bool anew) {
  const std::int64_t now_ns = unix_now_ns();
  const bool more = anew && senders_.add(frame);
  if (senders_.refused() > refused_) {
    refused_ = senders_.refused();
    bridge::say(
        kProgram,
        fmt::format("warning: {} bones are not sent: SUBJECT/BONE may have {} bytes, and there may be {} senders",
                    refused_, kMaxName_bytes, Senders::kMaxSenders));
  }
  const std::vector<Report> reports = senders_.report(frame, options_.axes, exposure_unix_ns(frame));
  for (const auto& [number, client] : clients_) {
    if (more) client->session.describe(now_ns);
    if (lost_) client->session.send_text(Severity::Normal, "mocapd sends again", now_ns);
    client->session.send(reports);
    flush(*client);
  }
  lost_ = false;
  remove_closed();
}

void Server::lose(const ClientFrame* last) {
  if (last == nullptr || std::exchange(lost_, true)) return;
  for (const auto& [number, client] : clients_) {
    client->session.send_text(Severity::Warning, "mocapd sends no data; reports stop until it returns", unix_now_ns());
    flush(*client);
  }
  remove_closed();
}

void Server::tick() {
  const std::int64_t now_ns = monotonic_ns();
  for (const auto& [number, client] : clients_) {
    if (!client->session.greeted() && now_ns - client->opened_ns > kGreeting_ns) {
      close(*client, "did not begin with VRPN's cookie in time");
    } else if (client->waits_for_room && now_ns - client->progress_ns > kStalled_ns) {
      close(*client, "does not read");
    }
  }
  remove_closed();
}

void Server::close_unreachable(const Peer& peer) {
  for (const auto& [number, client] : clients_) {
    if (client->peer.address != peer.address || client->session.udp_port() != peer.port) continue;
    close(*client, fmt::format("nobody listens at its UDP port {}", peer.port));
  }
}

void Server::close(Connection& client, const std::string& why) {
  if (client.closed) return;
  client.closed = true;
  bridge::say(kProgram, fmt::format("{}: {}", to_string(client.peer), why));
}

void Server::remove_closed() {
  std::erase_if(clients_, [this](const auto& entry) {
    if (entry.second->closed) loop_->forget(entry.first);
    return entry.second->closed;
  });
}

std::vector<bridge::Receiver> Server::receivers() const {
  std::vector<bridge::Receiver> all;
  for (const auto& [number, client] : clients_) {
    if (!client->session.greeted()) continue;
    const auto port = client->session.udp_port();
    all.push_back({to_string(client->peer), port ? fmt::format("udp {}", *port) : "tcp"});
  }
  return all;
}

}  // namespace mocap::vrpn
