#pragma once

#include <memory>
#include <string>

#include "base/result.h"
#include "ctl/live/live_command.h"
#include "mocap/v1/control.pb.h"
#include "wire/zmq_control.h"

namespace mocap::ctl {

/// The error of a command, with the exit code of the program.
struct LiveFailure {
  int exit = 0;
  std::string message;
};

/// Connects to the control endpoint of the daemon with the keys of the options.
Result<std::unique_ptr<wire::ControlClient>, LiveFailure> connect(const LiveOptions& options);

/// Sends a request and waits for its answer, at most `timeout_s`.
Result<v1::Answer, LiveFailure> ask_once(wire::ControlClient& client, const ControlRequest& request, double timeout_s);

int exit_code_of(v1::Code code);

/// Adds the options of the connection, and --json, except --timeout-s.
void add_endpoint_options(cli::App& command, LiveOptions& options);

/// Adds the options of the connection, and --json.
void add_connection_options(cli::App& command, LiveOptions& options);

}  // namespace mocap::ctl
