// mocap-natnet: serves the feed to NatNet clients.
#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridges/lib/event_loop.h"
#include "bridges/natnet/server.h"
#include "bridges/natnet/take_orders.h"

namespace {

using namespace mocap;  // NOLINT: the program

constexpr const char* kExamples = R"(examples:
  mocap-natnet                                        clients on this machine, unicast
  mocap-natnet tcp://10.0.0.7:5570 --listen 10.0.0.9  clients in the network of the address 10.0.0.9
  mocap-natnet --listen 10.0.0.9 --multicast 239.255.42.99 --up z
  mocap-natnet --control tcp://127.0.0.1:5571         clients may start and end takes
  mocap-natnet --listen 10.0.0.9 --to 10.0.0.5:1511   a client that listens at a fixed port and never connects
exit codes: 0 stopped, 64 invalid command line, 69 the port is in use or the address is not of this machine)";

struct Options {
  bridge::BridgeOptions bridge;
  natnet::ServerOptions server;
  std::string group;
  std::string version = "3.1";
  std::vector<std::string> to;
  std::string control;
  int command_port = 1510;
  int data_port = 1511;
};

void add_options(cli::App& app, Options& options) {
  bridge::add_bridge_options(app, options.bridge, true);
  app.add_option("--multicast", options.group, "send to this group instead of to each client; usual: 239.255.42.99")
      ->check(cli::ValidIPV4{})
      ->type_name("GROUP");
  app.add_option("--hops", options.server.hops, "number of networks that a multicast crosses, time to live")
      ->check(cli::Range(0, 255))
      ->capture_default_str();
  app.add_option("--command-port", options.command_port, "UDP port that clients connect to")
      ->check(cli::Range(1, 65535))
      ->capture_default_str();
  app.add_option("--data-port", options.data_port,
                 "UDP port of the multicast; the server names this port to its clients")
      ->check(cli::Range(1, 65535))
      ->capture_default_str();
  app.add_option("--bitstream", options.version,
                 "version for clients that ask for none, and of the multicast; a client may change its own")
      ->check(cli::IsMember{"3.0", "3.1", "4.0", "4.1"})
      ->capture_default_str();
  app.add_choice<natnet::UpAxis>("--up", options.server.settings.up,
                                 {{"y", natnet::UpAxis::Y}, {"z", natnet::UpAxis::Z}},
                                 "up axis until a client sets its own; default: y");
  app.add_choice<natnet::Naming>(
      "--naming", options.server.settings.naming,
      {{"motive", natnet::Naming::Motive}, {"fbx", natnet::Naming::Fbx}, {"bvh", natnet::Naming::Bvh}},
      "names of bones until a client sets its own; default: motive");
  app.add_option("--to", options.to, "also send to this address and port; may be repeated")
      ->one_value_each()
      ->type_name("ADDRESS:PORT");
  app.add_option(
         "--control", options.control,
         "let clients start and end takes through the daemon's control endpoint, usually tcp://ADDRESS:5571; with "
         "keys, --secret-key needs the role operator. NatNet clients prove nothing: whoever reaches the command port "
         "can record")
      ->type_name("ENDPOINT");
  app.add_flag("--discovery", options.server.answer_discovery, "answer clients that search for servers");
  app.add_option("--forget-after", options.server.forget_after_s,
                 "forget a silent client that never sent a keep-alive after this time, s; other clients are forgotten "
                 "after 60 s, and at once if their port is closed")
      ->check(cli::Range(1.0, 1e6))
      ->capture_default_str();
}

std::optional<bridge::Peer> read_peer(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto address = bridge::read_address(text.substr(0, colon));
  bridge::Peer peer;
  if (!address || colon == std::string::npos) return std::nullopt;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data() + colon + 1, end, peer.port);
  if (read.ec != std::errc() || read.ptr != end || peer.port == 0) return std::nullopt;
  peer.address = *address;
  return peer;
}

// Completes the server's options. Returns an error; empty: none.
std::string complete(Options& options) {
  options.server.command_port = static_cast<std::uint16_t>(options.command_port);
  options.server.data_port = static_cast<std::uint16_t>(options.data_port);
  options.server.listen = *bridge::read_address(options.bridge.listen);
  options.server.settings.version = *natnet::read_version(options.version);
  for (const std::string& text : options.to) {
    const auto peer = read_peer(text);
    if (!peer) return fmt::format("--to: {}: expected an IPv4 address and a port, as in 10.0.0.5:1511", text);
    const bool elsewhere =
        bridge::is_multicast(peer->address) || !bridge::has_route(options.server.listen, peer->address);
    if (bridge::is_loopback(options.server.listen) && elsewhere) {
      return fmt::format("--to: {}: is on another machine: give --listen an address of this machine, which is {} now",
                         text, options.bridge.listen);
    }
    options.server.to.push_back(*peer);
  }
  if (options.group.empty()) return {};
  options.server.group = bridge::read_address(options.group);
  if (bridge::is_multicast(*options.server.group)) return {};
  return fmt::format("--multicast: {} is no multicast group, expected 224.0.0.0 to 239.255.255.255", options.group);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  cli::App app("Serves a mocapd feed to NatNet clients, versions 3.0, 3.1, 4.0 and 4.1. Not affiliated with OptiTrack.",
               "mocap-natnet");
  app.footer(kExamples);
  add_options(app, options);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  if (const std::string fault = complete(options); !fault.empty()) return app.fail(fault);
  std::unique_ptr<natnet::TakeOrders> orders;
  if (!options.control.empty()) {
    bridge::block_end_signals();  // the orders have a thread
    std::string fault;
    orders = natnet::TakeOrders::open(options.control, options.bridge.keys, fault);
    if (!orders) return app.fail("--control: " + fault);
    options.server.record = [&orders](const natnet::Record& wanted) { return orders->order(wanted); };
  }
  bridge::Statistics statistics;
  natnet::Server server(options.server, statistics);
  const int exit = bridge::run_bridge("mocap-natnet", options.bridge, server, statistics);
  bridge::unblock_end_signals();  // the orders may wait for the end of a take: a second signal ends the program
  return exit;
}
