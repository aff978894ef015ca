#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/vrpn/message.h"
#include "bridges/vrpn/senders.h"

namespace mocap::vrpn {

/// The server's side of the protocol with one client, without its sockets: bytes in, bytes out. Reads no clock.
///
/// A client gets the reports of the senders that it has described, also of those that are offered later. A client that
/// has described none gets the reports of every bone and prop. Reports go by UDP if the client has described a UDP
/// port, otherwise by TCP.
class Session {
 public:
  /// Reports that a client has not received yet are bounded by this size; those of further frames are dropped.
  static constexpr std::size_t kMaxPending_bytes = 256 * 1024;
  static constexpr std::size_t kMaxNames = 2000;  ///< senders that a client may describe; VRPN's own limit

  /// `senders` outlives the session.
  explicit Session(const Senders& senders);

  /// Takes bytes that the client sent by TCP. Returns false if the connection is to be closed; then fault() has the
  /// reason.
  bool take(std::string_view bytes, std::int64_t unix_ns);
  /// Describes senders that are new since the last call.
  void describe(std::int64_t unix_ns);
  /// Adds the reports of one frame.
  void send(std::span<const Report> reports);
  /// Adds a text, which receivers print, under the first sender that the client gets.
  void send_text(Severity severity, std::string_view text, std::int64_t unix_ns);

  /// Bytes to send by TCP; the caller erases what was sent.
  std::string& output() { return output_; }
  /// Datagrams to send to udp_port(); the caller clears them.
  std::vector<std::string>& datagrams() { return datagrams_; }
  std::optional<std::uint16_t> udp_port() const { return udp_port_; }

  /// Whether the client has sent its cookie.
  bool greeted() const { return greeted_; }
  const std::string& fault() const { return fault_; }
  /// Frames whose reports were dropped, because the client does not read.
  std::uint64_t dropped() const { return dropped_; }
  std::uint64_t pings() const { return pings_; }

 private:
  enum class Step { Continue, Close };

  bool take_cookie(std::int64_t unix_ns);
  Step handle(const Message& message, std::int64_t unix_ns);
  Step close(std::string why);
  void note_sender(const Message& message);
  void answer_ping(std::int32_t remote_sender, std::int64_t unix_ns);
  void put(std::string bytes);
  bool wants(const Report& report) const;
  void update_wanted();
  void send_by_udp(const std::string& messages);

  const Senders& senders_;
  std::string cookie_;
  bool greeted_ = false;
  MessageReader reader_;
  std::map<std::int32_t, std::string> remote_senders_;
  std::optional<std::int32_t> ping_type_;  // the client's number of it
  std::set<std::int32_t> wanted_;          // numbers of senders that the client has described
  std::size_t described_ = 0;              // senders that the client knows
  std::optional<std::uint16_t> udp_port_;
  std::string output_;
  std::vector<std::string> datagrams_;
  std::uint32_t sequence_ = 0;
  std::uint64_t dropped_ = 0;
  std::uint64_t pings_ = 0;
  std::string fault_;
};

}  // namespace mocap::vrpn
