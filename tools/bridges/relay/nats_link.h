#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"
#include "bridges/relay/server.h"

namespace mocap::relay {

struct NatsSettings {
  Server server;
  std::filesystem::path ca;  ///< certificates of the authorities that may sign the server's; empty: those of the system
  Credentials credentials;
};

struct NatsState {
  bool connected = false;
  std::uint64_t connections = 0;  ///< since the start
  std::string reason;             ///< why nothing is sent, and a remedy; empty: no fault
};

/// The connection to a NATS server. A thread connects, reconnects, and measures with a ping how far the server is
/// behind.
class NatsLink {
 public:
  /// Starts to connect. Fails with InvalidArgument if the file of the authorities cannot be read.
  static Result<std::unique_ptr<NatsLink>> open(const NatsSettings& settings);
  ~NatsLink();

  /// Whether a message that is sent now reaches the server soon: the link is connected, and the server has answered to
  /// all that was sent more than half a second ago. This bounds what waits in the kernel and in the network.
  bool ready() const;

  /// Sends a message. Returns false if the message was not taken. May wait while the kernel takes no bytes, at most a
  /// second.
  bool publish(const std::string& subject, std::string_view payload);

  NatsState state() const;

 private:
  struct Impl;
  explicit NatsLink(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A sentence for the operator: why the connection failed and what to do. `text`: of the library.
std::string explain_nats(int status, std::string_view text, const Server& server);

}  // namespace mocap::relay
