#include "bridges/udp/send_options.h"

namespace mocap::bridge {

void add_send_options(cli::App& app, SendOptions& options) {
  app.add_option("endpoint", options.feed.endpoint, "the feed")->capture_default_str();
  app.add_option("--to", options.host, "host of the receiver")->capture_default_str();
  app.add_option("--port", options.port, "UDP port of the receiver")->capture_default_str();
  app.add_option("--rate", options.rate_hz, "largest frame rate, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  app.add_option(
         "--status-file", options.status_file,
         "write the statistics to this file once a second; without it, to a file that mocapctl bridge list reads")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "end after this time")->check(cli::PositiveNumber{});
  cli::add_key_options(app, options.keys);
}

}  // namespace mocap::bridge
