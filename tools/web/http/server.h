#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/result.h"
#include "web/access/access.h"
#include "wire/curve_keys.h"

namespace mocap::web {

struct ServerSettings {
  std::string feed = "tcp://127.0.0.1:5570";
  std::string control;  ///< empty: the port after the feed's
  wire::ClientKeys keys = {};
  std::string takes;  ///< folder of the recorded takes; empty: that of the take which a local daemon reports
  std::string listen = "127.0.0.1";
  std::uint16_t port = 5580;  ///< 0: any free port
  std::string certificate;    ///< PEM file; empty: no TLS
  std::string private_key;    ///< PEM file
  AccessSettings access = {};
  double accepts_hz = 100.0;  ///< new connections a second, on average; twice as many at once
  double timeout_s = 20.0;    ///< a client that is silent for this time, or does not read, is cut
};

/// Serves the page, the API and the metrics: one port, one thread, beside the threads of the FeedReader and the
/// ControlWorkers. This is the only class that knows Boost.Beast.
class Server {
 public:
  /// Opens the port and begins to connect to the daemon. Fails with InvalidArgument (an address beyond this machine
  /// without TLS and tokens, a malformed address, endpoint or certificate), Busy (another program listens there) and
  /// Io.
  static Result<std::unique_ptr<Server>> open(const ServerSettings& settings);
  ~Server();

  /// The address of the page: "http://127.0.0.1:5580".
  std::string address() const;

  /// Serves until SIGINT or SIGTERM; ends exports and imports then, which leave no file.
  void run();

  /// Whether the daemon or a disk has not answered a request yet: the destructor would wait for it, as
  /// long as `patience_of` says.
  bool waits() const;

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Refuses an address beyond this machine without TLS and tokens.
Status check_exposure(const ServerSettings& settings);

}  // namespace mocap::web
