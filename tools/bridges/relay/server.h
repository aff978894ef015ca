#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace mocap::relay {

/// A NATS server.
struct Server {
  std::string host;
  std::string port = "4222";
  bool tls = true;

  /// As NATS writes it: tls://HOST:PORT or nats://HOST:PORT.
  std::string url() const;
  /// Whether only this machine reaches the address.
  bool is_local() const;

  bool operator==(const Server&) const = default;
};

/// Reads tls://HOST[:PORT], nats://HOST[:PORT] or HOST[:PORT]; an IPv6 address is in brackets. A text without tls:// or
/// nats:// has TLS beyond this machine. Returns nothing if the text is no such server.
std::optional<Server> read_server(std::string_view text);

/// The credentials that the relay sends to the server. All empty: the relay connects without credentials.
struct Credentials {
  std::string user = {};  // the initialisers avoid a warning if a member is omitted
  std::string password = {};
  std::string token = {};
  std::filesystem::path jwt = {};  ///< a file of NATS with a JWT and a seed, which its library reads
};

/// Reads a file that only its owner may read: a credentials file of NATS, a line USER:PASSWORD, or a line with a token.
/// Fails with NotFound (no such file) and InvalidArgument (others may read the file; it has another content).
Result<Credentials> read_credentials(const std::filesystem::path& path);

}  // namespace mocap::relay
