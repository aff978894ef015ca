#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "wire/curve_keys.h"
#include "wire/wire_settings.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {

/// By this name ZeroMQ asks us who may connect.
inline constexpr std::string_view kAuthenticationDomain = "mocap";

/// Says which clients' keys may connect: answers ZeroMQ's requests for authentication (ZAP, RFC 27) in one context. One
/// for each context; opened before the sockets that it guards are bound. One thread; `serve` often, or nobody gets in.
class Gatekeeper {
 public:
  /// `who`: as the log calls it. Fails with what load_key_pair and load_allowed_keys say, and with Io.
  static Result<std::unique_ptr<Gatekeeper>> open(const ZmqContext& context, const CurveSettings& settings,
                                                  std::string who);

  /// Makes `socket` a CURVE server that asks us. ZeroMQ might ask nobody where `domain` is empty: fails then.
  Status guard(ZmqSocket& socket, std::string_view domain = kAuthenticationDomain) const;

  /// Answers who asks, `at_most` of them.
  void serve(int at_most, Timestamp now);

  /// Reads the list again if it was changed; gives the keys that were taken from it since the last call. A list that
  /// cannot be read leaves all as it was. About once a second.
  std::vector<std::string> look_for_revoked();

  /// The role of a client by what ZmqMessage::user says of its messages; none: not allowed (any more).
  std::optional<Role> role_of(std::string_view user) const;
  /// Whose key it is, for the log.
  std::string_view name_of_user(std::string_view user) const;

  void* socket() const { return socket_.get(); }
  std::uint64_t refused() const { return refused_; }
  std::size_t allowed() const { return allowed_.size(); }

 private:
  Gatekeeper(std::filesystem::path allowed_file, std::string who);
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
  void judge(Timestamp now);
  void tell_refused(const std::string& key, std::string_view address, Timestamp now);

  std::filesystem::path file_;
  std::string who_;
  KeyPair server_;
  ZmqSocket socket_;
  std::map<std::string, AllowedKey, std::less<>> allowed_;  // by key
  FileState read_state_;
  std::vector<std::string> revoked_;  // since somebody asked
  std::string request_id_;
  std::uint64_t refused_ = 0;
  std::map<std::string, Timestamp> told_;  // refused keys, and when the log had them
  bool told_unreadable_ = false;
};

}  // namespace mocap::wire
