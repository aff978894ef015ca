#pragma once

#include <string>

#include "lib/cli/app.h"
#include "lib/cli/key_options.h"
#include "mocap_client.hpp"

namespace mocap::bridge {

/// The options of a program that sends the feed to one UDP receiver.
struct SendOptions {
  ClientOptions feed;
  std::string host = "127.0.0.1";
  std::string port = {};
  double rate_hz = 60.0;         ///< largest rate
  double seconds = 0.0;          ///< end after this time; 0: never
  std::string status_file = {};  ///< written once a second with the statistics; empty: see StatusFile
  cli::KeyOptions keys = {};     // the initialiser avoids a warning if the member is omitted
};

/// Adds these options to the command line. `options` must outlive App::parse().
void add_send_options(cli::App& app, SendOptions& options);

}  // namespace mocap::bridge
