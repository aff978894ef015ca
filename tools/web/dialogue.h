#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/time.h"
#include "web/feed/viewer.h"

namespace mocap::web {

/// The interface of a connection for its dialogue, while the connection exists.
struct Connection {
  std::function<void()> wake;                                   ///< a message may be ready
  std::function<void(const std::string& reason)> cut;           ///< ends the connection and counts `reason`
  std::function<void(const std::string& reason)> note_refused;  ///< counts a message that cannot be executed
  std::function<std::shared_ptr<void>()> hold;                  ///< the connection exists as long as the result does
  std::function<void()> topics_changed;                         ///< the feed's topics that are wanted have changed
};

/// The messages over one WebSocket, in one subprotocol. One thread. Made when the connection opens, destroyed when it
/// ends.
class Dialogue {
 public:
  virtual ~Dialogue() = default;
  /// Takes a message of the client.
  virtual void take(const std::string& message, bool is_text) = 0;
  /// The next message to send.
  virtual std::optional<Outgoing> next() = 0;
  /// Called once a second, and when the connection to the daemon begins or ends.
  virtual void note_time(Timestamp now) = 0;
};

}  // namespace mocap::web
