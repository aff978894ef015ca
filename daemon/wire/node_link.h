#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "model/blob.h"
#include "model/clock/ptp_line.h"
#include "module/node_server.h"
#include "wire/client_link.h"
#include "wire/curve_keys.h"

namespace mocap::wire {

struct NodeLinkSettings {
  std::string endpoint;
  std::string camera;  ///< its name on the node; empty: no images are wanted, only echoes that list the cameras
  ClientKeys keys = {};
};

/// The answer of a node to a call.
struct NodeEcho {
  Timestamp called_at;    ///< host's clock
  Timestamp received_at;  ///< node's clock
  Timestamp sent_at;      ///< node's clock
  Timestamp arrived_at;   ///< host's clock
  std::string node;       ///< its name
  std::uint64_t session = 0;
  NodeCamera camera;
  std::vector<NodeCamera> cameras;  ///< of the node, if the link names no camera
  bool recorded = false;
  std::string control;              ///< endpoint of the node's requests as it is bound; empty: none
  std::optional<PtpLine> ptp = {};  ///< PTP's time at sent_at on the node's clock, where the node measures it
};

/// One image; its times are on the node's clock.
struct NodeImage {
  std::uint64_t sequence = 0;
  BlobFrame blobs;
};

enum class NodeNews { Echo, Image, Refusal };

/// The connection of a fusion host to one camera of a node. Connects again by itself, also after the node rejected its
/// key. One thread owns it. All connections of a process share the two threads of one ZeroMQ context.
class NodeLink {
 public:
  /// Starts to connect; the node may start later. Fails with InvalidArgument (a malformed endpoint) and Io.
  static Result<std::unique_ptr<NodeLink>> open(const NodeLinkSettings& settings);
  ~NodeLink();

  /// Asks for an echo and for further images; lost without a connection. `ended`: all images of a recording arrived.
  void call(bool ended = false);

  /// Waits at most `patience` for the next message, which one of the functions below returns until the next call. Fails
  /// with Timeout, and with Io if the message is malformed: nothing of it is used.
  Result<NodeNews> next(Duration patience);
  const NodeEcho& echo() const;
  NodeImage& image();
  const std::string& refusal() const;

  /// Why there is no connection, with the remedy; empty if none is known.
  std::string fault() const;

 private:
  struct Impl;
  explicit NodeLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::wire
