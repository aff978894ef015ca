#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "wire/role.h"

namespace mocap::wire {

/// A CURVE key pair, each key as 40 characters of Z85 (ZeroMQ RFC 32).
struct KeyPair {
  std::string public_key;
  std::string secret_key;
};

/// One line of the list of those who may connect.
struct AllowedKey {
  std::string public_key;
  Role role = Role::Viewer;
  std::string name;  ///< whose key it is, for people: one word
};

bool is_key(std::string_view text);

/// Fails with Unsupported where ZeroMQ was built without CURVE.
Result<KeyPair> new_key_pair();

/// Writes `path` for its owner alone (mode 600). Fails with Busy where there is such a file already, and with Io.
Status save_key_pair(const std::filesystem::path& path, const KeyPair& pair);

/// Fails with NotFound, and with InvalidArgument (no file of ours).
Result<KeyPair> load_key_pair(const std::filesystem::path& path);

/// The public key in a file of `save_key_pair` (or with its secret line taken out).
Result<std::string> load_public_key(const std::filesystem::path& path);

/// A line "KEY ROLE NAME" a client; what follows a # is a comment. Fails with NotFound, and with InvalidArgument and
/// the line.
Result<std::vector<AllowedKey>> load_allowed_keys(const std::filesystem::path& path);

/// Replaces the list as a whole or, when that fails, not at all.
Status save_allowed_keys(const std::filesystem::path& path, const std::vector<AllowedKey>& keys);

}  // namespace mocap::wire
