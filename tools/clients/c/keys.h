#pragma once

#include <string>

namespace mocap::client {

/// CURVE keys, each 40 characters of Z85. All empty: no encryption.
struct Keys {
  std::string server;
  std::string own_public;
  std::string own_secret;
};

/// Replaces each path by the key in that file. Each member may be a key or a file of `mocapctl keys new` (lines "public
/// KEY" and "secret KEY"). If `own_secret` is a file, `own_public` may be empty. Returns an error message, or an empty
/// string.
std::string read_keys(Keys& keys);

}  // namespace mocap::client
