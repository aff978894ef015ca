#include "bridges/natnet/server.h"

#include <fmt/format.h>
#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <tuple>
#include <utility>

#include "bridges/lib/feed_source.h"
#include "bridges/natnet/command.h"

namespace mocap::natnet {
namespace {

using bridge::monotonic_ns;
using bridge::Peer;

constexpr std::string_view kProgram = "mocap-natnet";
// A new client, or one that changed its version, gets no frame before it got the descriptions: clients decode frames
// that are under way with the wrong version. A client that asks for no descriptions gets them after this time.
constexpr std::int64_t kHold_ns = 1'000'000'000;
// A receiver of --to that starts later than this program waits at most this long for the descriptions.
constexpr std::int64_t kDescribe_ns = 3'000'000'000;
// The bound on the log of a flood of clients. The replacements between two lines are counted.
constexpr std::int64_t kTellReplaced_ns = 10'000'000'000;

std::array<std::uint8_t, 4> bytes_of(std::uint32_t address) {
  return {static_cast<std::uint8_t>(address >> 24U), static_cast<std::uint8_t>(address >> 16U),
          static_cast<std::uint8_t>(address >> 8U), static_cast<std::uint8_t>(address)};
}

}  // namespace

Server::Server(ServerOptions options, bridge::Statistics& statistics)
    : options_(std::move(options)), statistics_(statistics) {
  const Client fixed{.settings = options_.settings, .fixed = true};
  for (const Peer& to : options_.to) clients_.emplace(to, fixed);
  if (options_.group) clients_.emplace(Peer{*options_.group, options_.data_port}, fixed);
}

std::string Server::open(bridge::EventLoop& loop) {
  std::string fault;
  socket_ = bridge::UdpSocket::open({options_.listen, options_.command_port}, fault);
  if (!socket_) return fault;
  if (options_.group && !socket_->send_multicast_from(options_.listen, options_.hops)) {
    return "this machine cannot send multicasts from the address of --listen";
  }
  bridge::warn_if_open(kProgram, "NatNet", options_.listen);
  loop.watch(socket_->descriptor(), EPOLLIN, [this](std::uint32_t /*events*/) {
    socket_->receive([this](const Peer& from, std::string_view packet) { receive(from, packet); },
                     [this](const Peer& peer) { forget(peer); });
  });
  bridge::say(kProgram, fmt::format("serves NatNet clients at {}{}", bridge::to_string(socket_->bound()),
                                    options_.group ? ", multicast to " +
                                                         bridge::to_string(Peer{*options_.group, options_.data_port})
                                                   : ""));
  return {};
}

void Server::receive(const Peer& from, std::string_view packet) {
  const std::optional<Request> request = read_request(packet);
  if (!request) {
    ++statistics_.invalid;
    return;
  }
  ++statistics_.requests;
  handle(from, *request);
}

void Server::handle(const Peer& from, const Request& request) {
  switch (request.message) {
    case Message::Connect: return connect(from, request);
    case Message::Discovery:
      if (options_.answer_discovery)
        send_server_info(from, nearest(request.wanted.value_or(options_.settings.version)));
      return;
    case Message::EchoRequest:
      send(from, echo_packet(writer_, request.stamp, static_cast<std::uint64_t>(monotonic_ns())));
      return;
    case Message::Disconnect: return forget(from);
    default: break;
  }
  Client* client = known(from);
  if (client == nullptr && request.message == Message::KeepAlive) {
    // A client of the time before this program started: it learns the version, and then gets frames again.
    connect(from, request);
    client = known(from);
  }
  if (client == nullptr) client = join(from, /*connected=*/false);
  if (client == nullptr) return;
  client->heard_ns = monotonic_ns();
  if (request.message == Message::KeepAlive) client->keeps_alive = client->connected = true;
  if (request.message == Message::RequestModels) send_models(from, *client);
  if (request.message == Message::Request) command(from, *client, request.text);
}

Server::Client* Server::known(const Peer& from) {
  const auto found = clients_.find(from);
  return found == clients_.end() ? nullptr : &found->second;
}

// Frames are held until the client got the descriptions.
Server::Client* Server::join(const Peer& from, bool connected) {
  if (clients_.size() >= kMaxClients && !replace_most_silent(from, connected)) return nullptr;
  const std::int64_t now_ns = monotonic_ns();
  const Client joined{.settings = options_.settings, .heard_ns = now_ns, .held_ns = now_ns, .connected = connected};
  return &clients_.emplace(from, joined).first->second;
}

bool Server::replace_most_silent(const Peer& by, bool connected) {
  const auto worth = [](const Client& client) { return std::tuple(client.fixed, client.connected, client.heard_ns); };
  const auto least = std::min_element(clients_.begin(), clients_.end(), [&](const auto& one, const auto& other) {
    return worth(one.second) < worth(other.second);
  });
  if (least == clients_.end() || least->second.fixed || (least->second.connected && !connected)) return false;
  tell_replaced(least->first, by);
  clients_.erase(least);
  return true;
}

void Server::tell_replaced(const Peer& old, const Peer& by) {
  const std::int64_t now_ns = monotonic_ns();
  ++replaced_untold_;
  if (replacement_told_ns_ && now_ns - *replacement_told_ns_ < kTellReplaced_ns) return;
  bridge::say(kProgram, fmt::format("warning: client {} gets no more frames: client {} has its place, because at most "
                                    "{} clients are served; replaced since the last such line: {}",
                                    bridge::to_string(old), bridge::to_string(by), kMaxClients,
                                    std::exchange(replaced_untold_, 0)));
  replacement_told_ns_ = now_ns;
}

void Server::connect(const Peer& from, const Request& request) {
  Client* client = known(from);
  if (client == nullptr) client = join(from, /*connected=*/true);
  if (client == nullptr) return;
  const std::int64_t now_ns = monotonic_ns();
  *client = Client{
      .settings = options_.settings, .heard_ns = now_ns, .held_ns = now_ns, .fixed = client->fixed, .connected = true};
  if (!options_.group) {  // all receivers of a multicast share its version
    if (request.wanted) client->settings.version = nearest(*request.wanted);
    client->settings.subscribed_only = request.subscribed_only;
  }
  send_server_info(from, client->settings.version);
}

void Server::command(const Peer& from, Client& client, std::string_view text) {
  const Settings before = client.settings;
  Answer answer = execute(text, client.settings,
                          {reader_.scene().rate_hz, /*changeable=*/!options_.group.has_value(),
                           /*records=*/options_.record != nullptr});
  if (const auto* wanted = std::get_if<Record>(&answer)) {
    bridge::say(kProgram, fmt::format("{} {} a take", to_string(from), wanted->start ? "starts" : "ends"));
    answer = options_.record(*wanted) ? kDone : kNotPossible;
  }
  if (client.settings.version != before.version) client.held_ns = monotonic_ns();
  if (const auto* code = std::get_if<std::int32_t>(&answer)) send(from, response_packet(writer_, *code));
  if (const auto* number = std::get_if<float>(&answer)) send(from, response_packet(writer_, *number));
  if (const auto* word = std::get_if<std::string>(&answer)) {
    send(from, response_packet(writer_, std::string_view(*word)));
  }
  if (std::holds_alternative<Unknown>(answer)) send(from, unrecognised_packet(writer_));
  if (std::holds_alternative<Leave>(answer)) {
    send(from, response_packet(writer_, kDone));
    forget(from);
  }
}

void Server::send_server_info(const Peer& to, Version version) {
  send(to, server_info_packet(writer_, {version, options_.data_port, options_.group.has_value(),
                                        bytes_of(options_.group.value_or(0))}));
}

void Server::send_models(const Peer& to, Client& client) {
  send(to, models_packet(writer_, reader_.scene(), client.settings));
  client.held_ns = 0;
}

void Server::send_models_to_all() {
  for (auto& [peer, client] : clients_) {
    if (!bridge::is_multicast(peer.address) && client.held_ns == 0) send_models(peer, client);
  }
}

void Server::send(const Peer& to, std::string_view packet) {
  if (packet.empty()) {
    ++statistics_.dropped;
    if (!std::exchange(too_large_, true)) {
      bridge::say(
          kProgram,
          "warning: a frame is larger than the 65507 bytes of a UDP packet and is not sent; clients must switch "
          "markers off, or the daemon must track fewer subjects");
    }
    return;
  }
  const bridge::Sent sent = socket_->send(to, packet);
  if (sent == bridge::Sent::Refused && !std::exchange(refused_, true)) {
    bridge::say(kProgram, fmt::format("warning: this machine refuses to send from {} to {}: see ip route get; further "
                                      "refused packets are only counted",
                                      bridge::to_string(socket_->bound()), bridge::to_string(to)));
  }
  if (sent != bridge::Sent::Done) {
    ++statistics_.dropped;
    return;
  }
  ++statistics_.sent;
  statistics_.bytes += packet.size();
}

// Clients with the same settings get the same packet.
void Server::send_frames() {
  const auto now_ns = static_cast<std::uint64_t>(monotonic_ns());
  const Settings* encoded = nullptr;
  std::string_view packet;
  for (const auto& [peer, client] : clients_) {
    const bool gets_multicast = options_.group.has_value() && !client.fixed;
    if (client.held_ns != 0 || gets_multicast) continue;
    if (encoded == nullptr || !(*encoded == client.settings)) {
      packet = frame_packet(writer_, reader_.scene(), client.settings, now_ns);
      encoded = &client.settings;
    }
    send(peer, packet);
  }
}

void Server::take(const ClientFrame& frame, bool anew) {
  reader_.read(frame, anew, monotonic_ns());
  if (anew) send_models_to_all();
  send_frames();
}

void Server::lose(const ClientFrame* last) {
  if (last == nullptr) return;
  reader_.lose(monotonic_ns());
  send_frames();
}

bool Server::is_silent(const Client& client, std::int64_t now_ns) const {
  const auto patience_ns =
      client.keeps_alive ? kKeepAlive_ns : static_cast<std::int64_t>(options_.forget_after_s * 1e9);
  return now_ns - client.heard_ns > patience_ns;
}

void Server::tick() {
  const std::int64_t now_ns = monotonic_ns();
  for (auto entry = clients_.begin(); entry != clients_.end();) {
    const auto next = std::next(entry);
    if (is_silent(entry->second, now_ns)) forget(entry->first);
    entry = next;
  }
  for (auto& [peer, client] : clients_) {
    if (client.held_ns != 0 && now_ns - client.held_ns > kHold_ns) send_models(peer, client);
  }
  if (now_ns - described_ns_ < kDescribe_ns) return;
  described_ns_ = now_ns;
  for (auto& [peer, client] : clients_) {
    if (client.fixed && !bridge::is_multicast(peer.address) && client.held_ns == 0) send_models(peer, client);
  }
}

// A fixed receiver that got another version than that of the options gets no frame before it got the descriptions.
void Server::forget(const Peer& peer) {
  const auto found = clients_.find(peer);
  if (found == clients_.end()) return;
  Client& client = found->second;
  if (!client.fixed) {
    clients_.erase(found);
    return;
  }
  const bool same_version = client.settings.version == options_.settings.version;
  client =
      Client{.settings = options_.settings, .held_ns = same_version ? client.held_ns : monotonic_ns(), .fixed = true};
}

std::vector<bridge::Receiver> Server::receivers() const {
  std::vector<bridge::Receiver> all;
  for (const auto& [peer, client] : clients_) {
    all.push_back({bridge::to_string(peer), to_string(client.settings)});
  }
  return all;
}

}  // namespace mocap::natnet
