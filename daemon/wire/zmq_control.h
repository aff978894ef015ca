#pragma once

#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "module/control_server.h"
#include "wire/curve_keys.h"
#include "wire/wire_settings.h"

namespace mocap::wire {

/// The control endpoint that stands beside a feed's: the next port, or PATH.control.
std::string control_beside(const std::string& feed_endpoint);

/// Takes requests over a ZeroMQ ROUTER socket. What cannot be read, or what its sender's role does not allow, is
/// answered here.
class ZmqControl final : public ControlServer {
 public:
  /// Fails as ZmqPublisher::open.
  static Result<std::unique_ptr<ZmqControl>> open(const ControlSettings& settings);
  ~ZmqControl() override;

  std::optional<ControlRequest> next(Duration patience) override;
  void answer(const ControlAnswer& answer) override;

  const std::string& endpoint() const;

 private:
  struct Impl;
  explicit ZmqControl(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Sends requests and waits for their answers. For tools and tests. One thread.
class ControlClient {
 public:
  struct Settings {
    std::string endpoint = "tcp://127.0.0.1:5571";
    std::string server_key = {};  ///< the server's public key; empty: no CURVE
    KeyPair own_key = {};
  };
  /// Fails with InvalidArgument (an endpoint or a key that is none).
  static Result<std::unique_ptr<ControlClient>> open(const Settings& settings);
  ~ControlClient();

  /// The answer, as it came, without its id. Fails with Timeout when none came within `patience`.
  Result<std::string> ask(const std::string& request, Duration patience);

 private:
  struct Impl;
  explicit ControlClient(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::wire
