#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "module/audit_trail.h"
#include "module/node_server.h"
#include "module/ptp_clock.h"
#include "wire/wire_settings.h"

namespace mocap::wire {

struct NodeServerSettings {
  NodeSettings node;
  bool recorded = false;  ///< the cameras play a recording: no image may be lost, and each camera has one host
  std::string control;    ///< endpoint of [control]; empty: none
  /// The node's clock as a function of the host's; null: the same clock. For tests on one machine.
  std::function<Timestamp(Timestamp)> clock = {};
  const PtpClock* ptp = nullptr;  ///< of this machine; null: echoes have no PTP time
};

/// Sends blobs over a ZeroMQ ROUTER socket (proto/mocap/v1/node.proto). A host that has not called for a second gets no
/// images. At most 256 hosts and cameras together are served. Replayed traffic is not accepted where [security] has
/// keys: CURVE numbers the messages of a connection and gives each connection new keys.
class ZmqNodeServer final : public NodeServer {
 public:
  /// `audit`: notes connections; outlives the server; may be null. Fails as ZmqPublisher::open.
  static Result<std::unique_ptr<ZmqNodeServer>> open(const NodeServerSettings& settings, AuditTrail* audit = nullptr);
  ~ZmqNodeServer() override;

  void serve(const std::vector<NodeCamera>& cameras, Duration patience) override;
  NodeSend send(const BlobFrame& frame) override;
  bool acknowledged(CameraId camera) const override;
  WakeDescriptor& wake() override;

  const std::vector<std::string>& endpoints() const;  ///< with the port numbers in use

 private:
  struct Impl;
  explicit ZmqNodeServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::wire
