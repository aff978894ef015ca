#pragma once

#include <string>

#include "lib/cli/app.h"

namespace mocap::cli {

/// The keys (CURVE) of a program that connects to a daemon. Both empty: no keys.
struct KeyOptions {
  std::string server_key;  ///< the daemon's public key, or a file with it
  std::string secret_key;  ///< a file of mocapctl keys new: the program's own key pair
};

/// Adds --server-key and --secret-key, the names that all programs and client libraries use; --key, the former name of
/// --secret-key, is read and not shown. `keys` must outlive App::parse().
void add_key_options(App& app, KeyOptions& keys);

}  // namespace mocap::cli
