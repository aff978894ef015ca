#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/time.h"
#include "wire/client_link.h"

namespace mocap::wire {

struct RequestSettings {
  std::string endpoint;
  // CURVE keys, 40 characters of Z85 each; an empty server key: no encryption.
  std::string server_key = {};
  std::string public_key = {};
  std::string secret_key = {};
  LinkWords words = {"[control] endpoint"};
};

/// The answer to a request, or the reason why none came.
struct Reply {
  std::optional<std::string> bytes;
  LinkFault fault = LinkFault::None;  ///< None without `bytes`: no answer within the patience
  bool connected = false;             ///< without `bytes`: the daemon has the connection, but did not answer
  std::string why;                    ///< without `bytes`: the reason and its remedy in one line
};

/// Sends requests to a control endpoint and waits for their answers. Needs ZeroMQ alone: the client library in C
/// compiles this class too. One thread at a time uses it.
class RequestSocket {
 public:
  /// Starts to connect. Returns nullptr if the endpoint or a key is malformed, with the reason in `fault`.
  static std::unique_ptr<RequestSocket> open(const RequestSettings& settings, std::string& fault);
  ~RequestSocket();

  /// Sends a serialised request and returns the next message of the daemon. Gives up if the daemon cannot be reached or
  /// rejects the keys for 0.8 s, and after `patience`. An answer that arrives later is discarded.
  Reply ask(std::string_view request, Duration patience);

 private:
  struct Impl;
  explicit RequestSocket(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mocap::wire
