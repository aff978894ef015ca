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

/// The connection to a feed. Reconnects automatically, also after errors after which ZeroMQ gives up (a key that is not
/// allowed yet). One thread must make all calls except interrupt().
class Socket {
 public:
  /// Starts to connect. Returns nullptr if a setting is invalid, with the reason in `fault`.
  static std::unique_ptr<Socket> open(const SocketSettings& settings, std::string& fault);
  ~Socket();

  /// Waits at most `patience_ms` for messages and passes all waiting messages to `take`. Returns false after
  /// interrupt().
  bool receive(int patience_ms, const std::function<void(std::string_view)>& take);

  /// Ends the current and every later receive(). One other thread may call it, once.
  void interrupt();

  Link link() const;

 private:
  struct Impl;
  explicit Socket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::client
