#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "module/audit_trail.h"
#include "module/control_server.h"
#include "wire/curve_keys.h"
#include "wire/request_socket.h"
#include "wire/wire_settings.h"

namespace mocap::wire {

/// Returns the default control endpoint for a feed endpoint: the next port, or PATH.control for ipc. A feed endpoint
/// with port * is returned unchanged.
std::string control_beside(const std::string& feed_endpoint);

/// Receives requests over a ZeroMQ ROUTER socket. Malformed requests and requests that the sender's role does not
/// permit are answered with an error here; `next` returns the others.
class ZmqControl final : public ControlServer {
 public:
  /// `audit`: notes connections and refused requests; outlives the socket; may be null. Fails as ZmqPublisher::open.
  static Result<std::unique_ptr<ZmqControl>> open(const ControlSettings& settings, AuditTrail* audit = nullptr);
  ~ZmqControl() override;

  std::optional<ControlRequest> next(Duration patience) override;
  void answer(std::uint64_t request, const ControlAnswer& answer) override;

  const std::string& endpoint() const;

 private:
  struct Impl;
  explicit ZmqControl(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Sends requests and waits for their answers; for tools and tests. One thread owns it.
class ControlClient {
 public:
  struct Settings {
    std::string endpoint = "tcp://127.0.0.1:5571";
    ClientKeys keys = {};
  };
  /// Starts to connect. Fails with InvalidArgument if the endpoint or a key is malformed.
  static Result<std::unique_ptr<ControlClient>> open(const Settings& settings);
  ~ControlClient();

  /// Sends a serialised v1::Request and returns the next serialised v1::Answer. Fails with DeviceLost and the reason
  /// if the daemon cannot be reached or rejects the keys for 0.8 s, and with Timeout if no answer came within
  /// `patience`.
  Result<std::string> ask(const std::string& request, Duration patience);

 private:
  explicit ControlClient(std::unique_ptr<RequestSocket> socket);
  std::unique_ptr<RequestSocket> socket_;
};

}  // namespace mocap::wire
