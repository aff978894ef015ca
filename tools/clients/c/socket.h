#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "feed.h"
#include "keys.h"

namespace mocap::client {

struct SocketSettings {
  std::string endpoint;
  std::string topic;
  Keys keys;
};

/// The connection to a feed. It is made again by itself, also after failures after which ZeroMQ gives up (a key that is
/// not allowed yet). All calls but `interrupt` by one thread.
class Socket {
 public:
  /// Begins to connect. nullptr when a setting is wrong; `fault` then says which.
  static std::unique_ptr<Socket> open(const SocketSettings& settings, std::string& fault);
  ~Socket();

  /// Waits for messages at most `patience_ms` and gives all that wait to `take`. False once it was interrupted.
  bool receive(int patience_ms, const std::function<void(std::string_view)>& take);

  /// Ends the present and every later `receive`. By any one other thread, once.
  void interrupt();

  const Link& link() const;

 private:
  struct Impl;
  explicit Socket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Monotonic and UTC.
Now now();

}  // namespace mocap::client
