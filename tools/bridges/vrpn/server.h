#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axes.h"
#include "bridges/lib/bridge.h"
#include "bridges/lib/descriptor.h"
#include "bridges/lib/udp_socket.h"
#include "bridges/vrpn/senders.h"
#include "bridges/vrpn/session.h"

namespace mocap::vrpn {

struct ServerOptions {
  bridge::Peer at{.port = 3883};  ///< TCP and UDP; port 0: any, the same for both
  client::Axes axes{MOCAP_AXES_MOCAP};
  Offer offer = Offer::Bones;
};

/// A VRPN server: clients that connect by TCP, and clients that ask by UDP to be called back.
///
/// A client that asks by UDP is called back at the address from which the datagram came, whatever address it contains.
/// A datagram with a forged source address still directs a connection attempt to a third machine.
class Server : public bridge::Protocol {
 public:
  static constexpr std::size_t kMaxClients = 64;

  Server(const ServerOptions& options, bridge::Statistics& statistics);
  ~Server() override;

  std::string open(bridge::EventLoop& loop) override;
  void take(const ClientFrame& frame, bool anew) override;
  void lose(const ClientFrame* last) override;
  void tick() override;
  std::vector<bridge::Receiver> receivers() const override;

 private:
  struct Connection;

  std::string listen();
  void accept_client();
  void take_request(const bridge::Peer& from, std::string_view packet);
  void call_back(const bridge::Peer& client);
  void add(bridge::Descriptor socket, const bridge::Peer& peer, bool connected);
  void serve(Connection& client, std::uint32_t events);
  void finish_connecting(Connection& client);
  void receive(Connection& client);
  void flush(Connection& client);
  void send_datagrams(Connection& client);
  void close_unreachable(const bridge::Peer& peer);
  void close(Connection& client, const std::string& why);
  void remove_closed();

  ServerOptions options_;
  bridge::Statistics& statistics_;
  bridge::EventLoop* loop_ = nullptr;
  std::optional<bridge::UdpSocket> udp_;
  bridge::Descriptor listener_;
  Senders senders_;
  std::size_t refused_ = 0;                             // senders that the log has mentioned
  std::map<int, std::unique_ptr<Connection>> clients_;  // by descriptor
  bool lost_ = false;
};

}  // namespace mocap::vrpn
