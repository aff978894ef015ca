#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/lib/bridge.h"
#include "bridges/lib/udp_socket.h"
#include "bridges/natnet/command.h"
#include "bridges/natnet/packets.h"
#include "bridges/natnet/request.h"
#include "bridges/natnet/scene.h"
#include "bridges/natnet/settings.h"

namespace mocap::natnet {

struct ServerOptions {
  std::uint32_t listen = INADDR_LOOPBACK;
  std::uint16_t command_port = 1510;
  std::uint16_t data_port = 1511;
  std::optional<std::uint32_t> group;  ///< send to this multicast group, not to each client
  int hops = 1;                        ///< time to live of the multicast
  Settings settings;                   ///< of a new client and of the multicast
  std::vector<bridge::Peer> to;        ///< receivers that need not connect
  bool answer_discovery = false;
  /// Passes on a client's order about takes and returns whether it was accepted; empty: clients cannot record.
  std::function<bool(const Record&)> record;
  double forget_after_s = 3600.0;  ///< a silent client that never sent a keep-alive
};

/// The server of NatNet clients. A client's first message is CONNECT; a known client has settings of its own. A program
/// that asks without CONNECT gets frames too, but never takes the place of a connected client.
class Server : public bridge::Protocol {
 public:
  /// A client that sent a keep-alive is forgotten after this time without one.
  static constexpr std::int64_t kKeepAlive_ns = 60'000'000'000;
  /// With the receivers of `to`. A further client replaces the one that was silent for longest: of the clients that
  /// never connected, or, if there is none and the further client connects, of the connected ones.
  static constexpr std::size_t kMaxClients = 64;

  Server(ServerOptions options, bridge::Statistics& statistics);

  std::string open(bridge::EventLoop& loop) override;
  void take(const ClientFrame& frame, bool anew) override;
  void lose(const ClientFrame* last) override;
  void tick() override;
  std::vector<bridge::Receiver> receivers() const override;

 private:
  struct Client {
    Settings settings;
    std::int64_t heard_ns = 0;
    std::int64_t held_ns = 0;  // when frames were held back for this client; 0: it gets frames
    bool keeps_alive = false;  // it sent a keep-alive
    bool fixed = false;        // an option names it, or it is the multicast group: forget() leaves it in the list
    bool connected = false;    // it sent CONNECT or a keep-alive
  };

  void receive(const bridge::Peer& from, std::string_view packet);
  void handle(const bridge::Peer& from, const Request& request);
  void connect(const bridge::Peer& from, const Request& request);
  Client* known(const bridge::Peer& from);
  /// Adds a client; null if the list is full of clients that the new one may not replace.
  Client* join(const bridge::Peer& from, bool connected);
  bool replace_most_silent(const bridge::Peer& by, bool connected);
  void tell_replaced(const bridge::Peer& old, const bridge::Peer& by);
  void command(const bridge::Peer& from, Client& client, std::string_view text);
  void send_server_info(const bridge::Peer& to, Version version);
  void send_models(const bridge::Peer& to, Client& client);
  void send_models_to_all();
  void send_frames();
  void send(const bridge::Peer& to, std::string_view packet);
  /// Removes a client; puts a fixed one back to the settings of the options.
  void forget(const bridge::Peer& peer);
  bool is_silent(const Client& client, std::int64_t now_ns) const;

  ServerOptions options_;
  bridge::Statistics& statistics_;
  std::optional<bridge::UdpSocket> socket_;
  SceneReader reader_;
  PacketWriter writer_;
  std::map<bridge::Peer, Client> clients_;
  std::int64_t described_ns_ = 0;  // when the fixed receivers got the descriptions that nobody asked for
  std::optional<std::int64_t> replacement_told_ns_;  // when the last replacement was logged
  std::uint64_t replaced_untold_ = 0;                // since then
  bool too_large_ = false;                           // a packet was larger than UDP allows, which is logged once
  bool refused_ = false;                             // the kernel refused a packet, which is logged once
};

}  // namespace mocap::natnet
