#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "module/audit_trail.h"
#include "wire/curve_keys.h"
#include "wire/wire_settings.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {

/// The ZAP domain of the daemon's sockets.
inline constexpr std::string_view kAuthenticationDomain = "mocap";

/// Authenticates clients by their CURVE keys: answers ZeroMQ's authentication requests (ZAP, ZeroMQ RFC 27).
///
/// A ZeroMQ context has at most one Gatekeeper, opened before the guarded sockets are bound. One thread owns it and
/// must call `serve` often: a client can connect only after its request was answered.
class Gatekeeper {
 public:
  /// Reads the server's key pair and the list of allowed keys. `who` is the source in log lines. `audit`: notes refused
  /// clients and changes of the list; outlives the Gatekeeper; may be null. Fails as load_key_pair
  /// and load_allowed_keys, with InvalidArgument if the secret key is missing, and with Io.
  static Result<std::unique_ptr<Gatekeeper>> open(const ZmqContext& context, const CurveSettings& settings,
                                                  std::string who, AuditTrail* audit = nullptr);

  /// Makes `socket` a CURVE server that authenticates its clients here. Fails with InvalidArgument if `domain` is
  /// empty: ZeroMQ may skip authentication without a domain.
  Status guard(ZmqSocket& socket, std::string_view domain = kAuthenticationDomain) const;

  /// Answers the waiting authentication requests, at most `at_most`.
  void serve(int at_most, Timestamp now);

  /// Reloads the list if the file changed and returns the keys that were removed since the last call. If the file
  /// cannot be read, the previous list stays in force. Intended for about two calls a second.
  std::vector<std::string> look_for_revoked();

  /// Returns the role of the client `user` (ZmqMessage::user), or nothing if its key is not in the list any more.
  std::optional<Role> role_of(std::string_view user) const;
  /// Returns the name in the list of allowed keys, for log lines; empty if the key is not listed.
  std::string_view name_of_user(std::string_view user) const;

  void* socket() const { return socket_.get(); }
  std::uint64_t refused() const { return refused_; }
  std::size_t allowed() const { return allowed_.size(); }

 private:
  Gatekeeper(std::filesystem::path allowed_file, std::string who, AuditTrail* audit);
  struct FileState {
    std::filesystem::file_time_type written;
    std::uintmax_t size = 0;
    std::uint64_t inode = 0;
    bool operator==(const FileState&) const = default;
  };
  static FileState state_of(const std::filesystem::path& path);
  Status read_list();
  void refresh();
  void answer(std::string_view status, std::string_view text, std::string_view user);
  void authenticate(Timestamp now);
  void note_change(const std::map<std::string, AllowedKey, std::less<>>& before) const;
  void log_refused(const std::string& key, std::string_view address, Timestamp now);

  std::filesystem::path file_;
  std::string who_;
  AuditTrail* audit_;
  KeyPair server_;
  ZmqSocket socket_;
  std::map<std::string, AllowedKey, std::less<>> allowed_;  // by key
  FileState read_state_;
  std::vector<std::string> revoked_;  // since the last look_for_revoked()
  std::string request_id_;
  std::uint64_t refused_ = 0;
  std::map<std::string, Timestamp> logged_at_;  // by refused key: time of its last log line
  bool logged_unreadable_ = false;
};

}  // namespace mocap::wire
