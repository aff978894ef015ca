#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "mocap_client.h"

namespace mocap::vrpn {

// The wire format of VRPN 7: big endian. A message is a header of 24 bytes (bytes of header and payload, seconds,
// microseconds, sender, type, sequence number) and a payload, padded to a multiple of 8 bytes that the length does not
// count. Names of senders and types are described to the peer by messages of negative types. Source: facts about
// vrpn_Connection.C and vrpn_Tracker.C of github.com/vrpn/vrpn.
constexpr std::size_t kHeader_bytes = 24;
constexpr std::size_t kAlignment_bytes = 8;
constexpr std::size_t kCookie_bytes = 24;
constexpr std::size_t kMaxName_bytes = 99;        // receivers keep 100 with the final zero
constexpr std::size_t kMaxDatagram_bytes = 1472;  // of an Ethernet frame without fragments, as VRPN's own limit

constexpr std::int32_t kSenderDescription = -1;
constexpr std::int32_t kTypeDescription = -2;
constexpr std::int32_t kUdpDescription = -3;
constexpr std::int32_t kDisconnect = -5;

/// Types that this server describes, by their numbers here.
enum class Type : std::int32_t { Pose = 0, Velocity = 1, Pong = 2, Text = 3 };
inline constexpr std::string_view kTypeNames[] = {"vrpn_Tracker Pos_Quat", "vrpn_Tracker Velocity",
                                                  "vrpn_Base pong_message", "vrpn_Base text_message"};
inline constexpr std::string_view kPing = "vrpn_Base ping_message";

enum class Severity : std::int32_t { Normal = 0, Warning = 1 };

/// Time since the Unix epoch.
struct Stamp {
  std::int32_t seconds = 0;
  std::int32_t microseconds = 0;
};
Stamp stamp_of(std::int64_t unix_ns);

/// The 24 bytes with which each side begins a TCP connection.
std::string cookie();
/// Whether these 24 bytes come from a VRPN of version 7, whose minor versions are compatible.
bool is_cookie(std::string_view bytes);

/// One message with its header and padding, of sequence number 0.
std::string message(Stamp at, std::int32_t sender, std::int32_t type, std::string_view payload);
/// Replaces the sequence number of the message that begins at `start`. Precondition: there is one.
void number_message(std::string& bytes, std::size_t start, std::uint32_t sequence);

/// The payload of a description. `name` has at most kMaxName_bytes.
std::string describe_name(std::string_view name);
/// The name in the payload of a description; empty if it has none, or one that is too long.
std::optional<std::string_view> name_in(std::string_view payload);

/// "vrpn_Tracker Pos_Quat": sensor, padding, 3 doubles, 4 doubles x y z w; 64 bytes.
std::string pose_payload(std::int32_t sensor, mocap_vec3 position, mocap_quat rotation);
/// "vrpn_Tracker Velocity": sensor, padding, 3 doubles (m/s), 4 doubles (rotation of the next `dt`), dt = 0.01 s; 72
/// bytes. `spin` is an angular velocity in rad/s.
std::string velocity_payload(std::int32_t sensor, mocap_vec3 velocity, mocap_vec3 spin);
/// "vrpn_Base text_message": severity, level 0, text and a zero byte.
std::string text_payload(Severity severity, std::string_view text);

/// A message of a client. The payload is valid until the reader is called again.
struct Message {
  std::int32_t sender = 0;
  std::int32_t type = 0;
  std::string_view payload;
};

/// Splits the bytes of one client into messages. Begins after the cookie.
class MessageReader {
 public:
  /// The longest message that a client sends is a text of about 1 kB.
  static constexpr std::size_t kMaxMessage_bytes = 8192;

  void append(std::string_view bytes);
  /// The next whole message; empty: more bytes are needed, or the stream is broken.
  std::optional<Message> next();
  /// Whether a message had an impossible length. Then no further message can be found.
  bool broken() const { return broken_; }

 private:
  std::string bytes_;
  std::size_t used_ = 0;
  bool broken_ = false;
};

/// The TCP port on which a client waits to be called back, from its datagram "ADDRESS PORT" to the server's port. Empty
/// if the datagram is not such a request.
std::optional<std::uint16_t> callback_port(std::string_view datagram);

}  // namespace mocap::vrpn
