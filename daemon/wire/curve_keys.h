#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "wire/role.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {

/// A CURVE key pair, each key as 40 characters of Z85 (ZeroMQ RFC 32).
struct KeyPair {
  std::string public_key;
  std::string secret_key;
};

/// The keys with which a client connects.
struct ClientKeys {
  std::string server_key = {};  ///< the daemon's public key; empty: no CURVE
  KeyPair own_key = {};         ///< with CURVE: the client's key pair

  bool on() const { return !server_key.empty(); }
};

/// One line of the list of allowed client keys.
struct AllowedKey {
  std::string public_key;
  Role role = Role::Viewer;
  std::string name;  ///< owner of the key, for log lines; one word
};

/// Returns whether `text` is a CURVE key: 40 characters of valid Z85.
bool is_key(std::string_view text);

/// Generates a random key pair. Fails with Unsupported if ZeroMQ was built without CURVE.
Result<KeyPair> new_key_pair();

/// Writes a key pair to a new file `path` with mode 600. Fails with Busy if the file exists, and with Io.
Status save_key_pair(const std::filesystem::path& path, const KeyPair& pair);

/// Fails with InvalidArgument if the group or others have access to a file with a secret, or if the file does not
/// exist. The group is not considered for a credential of systemd ($CREDENTIALS_DIRECTORY).
Status check_private(const std::filesystem::path& path);

/// Reads a file of `save_key_pair`; `secret_key` is empty if the file has no secret line. Fails with NotFound if the
/// file cannot be read, and with InvalidArgument if the file is not a key file, or if it has a secret line and its
/// group or others have access to it. The group is not considered for a credential of systemd ($CREDENTIALS_DIRECTORY).
Result<KeyPair> load_key_pair(const std::filesystem::path& path);

/// Reads the public key of a file of `save_key_pair`; the secret line may be missing. Fails as `load_key_pair`
/// but for the access of others.
Result<std::string> load_public_key(const std::filesystem::path& path);

/// Reads the keys of a client from its options. `server_key` is a public key or a file with one; `secret_key` is a file
/// of `save_key_pair` with both lines. Both empty: no keys. Fails with InvalidArgument if only one is given, otherwise
/// as `load_key_pair`.
Result<ClientKeys> load_client_keys(const std::string& server_key, const std::string& secret_key);

/// Sets the keys of a client socket; does nothing without keys. Call before zmq_connect.
Status set_keys(ZmqSocket& socket, const ClientKeys& keys);

/// Reads the list of allowed client keys: one line "KEY ROLE NAME" for each client; text after # is a comment. Fails
/// with NotFound if the file cannot be read, and with InvalidArgument and the line number if a line is malformed.
Result<std::vector<AllowedKey>> load_allowed_keys(const std::filesystem::path& path);

/// Replaces the list atomically: writes a temporary file and renames it to `path`. A new list has mode 644. A failure
/// (Busy, Io) leaves the old list unchanged.
Status save_allowed_keys(const std::filesystem::path& path, const std::vector<AllowedKey>& keys);

}  // namespace mocap::wire
