#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/lib/event_loop.h"
#include "bridges/status/statistics.h"
#include "lib/cli/app.h"
#include "lib/cli/key_options.h"
#include "mocap_client.hpp"

namespace mocap::bridge {

/// The options that every bridge has.
struct BridgeOptions {
  std::string endpoint = "tcp://127.0.0.1:5570";
  cli::KeyOptions keys;
  std::string listen = "127.0.0.1";  ///< IPv4 address of this machine that receivers reach
  double lost_after_s = 0.5;         ///< without a frame for this time the feed is lost
  double statistics_s = 0.0;         ///< interval of the statistics in the log; 0: none
  double seconds = 0.0;              ///< end after this time; 0: never
  std::string status_file;           ///< written once a second with the statistics; empty: see StatusFile
};

/// Adds the options to the command line: ENDPOINT, keys, --listen, --lost-after, --statistics, --status-file,
/// --seconds. A bridge that only sends, and so listens nowhere, has `listens` false. `options` must outlive
/// App::parse().
void add_bridge_options(cli::App& app, BridgeOptions& options, bool listens);

/// One protocol, as run_bridge() drives it. Each method is called by one thread and never waits.
class Protocol {
 public:
  virtual ~Protocol() = default;

  /// Opens the sockets. Returns the reason and a remedy if that fails; empty: done.
  virtual std::string open(EventLoop& loop) = 0;

  /// Sends a new frame, which is in the axes of the feed (see receiver_axes.h). `anew`: the frame has another
  /// description than the frame before, or is the first one.
  virtual void take(const ClientFrame& frame, bool anew) = 0;

  /// The feed is lost: no frame came for lost_after_s. Called at once, and again at every tick until a frame comes.
  /// `last`: the newest frame; its description is valid, its poses are old. nullptr: no frame ever came.
  virtual void lose(const ClientFrame* last) = 0;

  /// Called every 100 ms: time-outs of receivers.
  virtual void tick() {}

  virtual std::vector<Receiver> receivers() const = 0;
};

/// Runs a bridge until SIGINT, SIGTERM or the end of options.seconds. Reconnects by itself. Logs to stderr: a sentence
/// when the reason why no data arrives changes, and statistics. `program`: its name. `statistics`: those that
/// `protocol` counts. Returns the exit code of the program: 0; 64 if an option of the feed is invalid; 69 if a socket
/// cannot be opened.
int run_bridge(std::string_view program, const BridgeOptions& options, Protocol& protocol, Statistics& statistics);

/// Logs that the protocol has neither encryption nor passwords, if `address` can be reached by other machines.
void warn_if_open(std::string_view program, std::string_view protocol, std::uint32_t address);

/// A line of the log, on stderr: "PROGRAM: TEXT".
void say(std::string_view program, std::string_view text);

}  // namespace mocap::bridge
