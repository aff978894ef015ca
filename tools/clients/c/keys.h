#pragma once

#include <string>

namespace mocap::client {

/// CURVE keys, 40 characters of Z85 each; all empty: none.
struct Keys {
  std::string server;
  std::string own_public;
  std::string own_secret;
};

/// Each may be a key, or a file of `mocapctl keys new` that holds it (lines "public KEY" and "secret KEY"); where
/// `own_secret` is such a file, `own_public` may be left out. Gives what is wrong, or nothing.
std::string read_keys(Keys& keys);

}  // namespace mocap::client
