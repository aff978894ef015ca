#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lib/cli/app.h"
#include "lib/cli/key_options.h"
#include "mocap_client.hpp"

namespace mocap::bridge {

/// The options of a program that sends the feed to UDP receivers.
struct SendOptions {
  ClientOptions feed;
  std::vector<std::string> to = {"127.0.0.1"};  ///< receivers, see read_target()
  std::string port = {};                        ///< of the receivers that name none
  double rate_hz = 60.0;                        ///< largest rate
  double seconds = 0.0;                         ///< end after this time; 0: never
  std::string status_file = {};                 ///< written once a second with the statistics; empty: see StatusFile
  cli::KeyOptions keys = {};                    // the initialiser avoids a warning if the member is omitted
};

/// A UDP receiver.
struct Target {
  std::string host;
  std::string port;

  bool operator==(const Target&) const = default;
};

/// Reads HOST or HOST:PORT; an IPv6 address with a port is [ADDRESS]:PORT. `port`: if the text has none. Returns
/// nothing if the text is no such receiver.
std::optional<Target> read_target(std::string_view text, const std::string& port);

/// Adds these options to the command line. `options` must outlive App::parse().
void add_send_options(cli::App& app, SendOptions& options);

}  // namespace mocap::bridge
