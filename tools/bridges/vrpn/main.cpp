// mocap-vrpn: serves a feed as VRPN trackers.
#include <cstdint>
#include <string>

#include "bridges/lib/bridge.h"
#include "bridges/lib/receiver_axes.h"
#include "bridges/vrpn/server.h"

int main(int argc, char** argv) {
  using namespace mocap;  // NOLINT: the program
  constexpr int kMaxPort = 65535;
  bridge::BridgeOptions options;
  int port = 3883;
  bool y_up = false;
  vrpn::Offer offer = vrpn::Offer::Bones;
  cli::App app(
      "Serves the feed of a mocapd as VRPN trackers over UDP and TCP: each bone is a tracker SUBJECT/BONE, each prop "
      "a tracker SUBJECT.",
      "mocap-vrpn");
  app.footer(R"(examples:
  mocap-vrpn                                       on this machine: actor/Hips@localhost
  mocap-vrpn tcp://10.0.0.7:5570 --listen 0.0.0.0  for other machines: actor/Hips@HOST, or actor/Hips@tcp://HOST
  mocap-vrpn --y-up --statistics 10                y up, and statistics each 10 s
exit codes: 0 ended by a signal or --seconds, 64 invalid command line, 69 the port is not available)");
  bridge::add_bridge_options(app, options, true);
  app.add_option("--port", port, "TCP and UDP port; 0: any")->check(cli::Range(0, kMaxPort))->capture_default_str();
  app.add_choice("--senders", offer,
                 {{"bones", vrpn::Offer::Bones}, {"bodies", vrpn::Offer::Bodies}, {"both", vrpn::Offer::Both}},
                 "bones: SUBJECT/BONE for each bone; bodies: SUBJECT, whose sensors are the bones");
  app.add_flag("--y-up", y_up, "x left, y up, z forward; default: x forward, y left, z up, as in ROS");
  if (const auto exit = app.parse(argc, argv)) return *exit;
  const vrpn::ServerOptions server{
      .at = {bridge::read_address(options.listen).value_or(INADDR_LOOPBACK), static_cast<std::uint16_t>(port)},
      .axes = y_up ? bridge::natnet_y_up() : bridge::vrpn_axes(),
      .offer = offer};
  bridge::Statistics statistics;
  vrpn::Server protocol(server, statistics);
  return bridge::run_bridge("mocap-vrpn", options, protocol, statistics);
}
