#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "axes.h"
#include "frame.h"
#include "wire/client_link.h"

namespace mocap::client {

/// An instant on this host's clocks, ns.
struct Now {
  std::int64_t host_ns = 0;  ///< monotonic
  std::int64_t utc_ns = 0;
};

/// State of the connection.
struct Link {
  bool connected = false;     ///< the handshake succeeded
  std::int64_t since_ns = 0;  ///< time of the last change of `connected`, or of the opening
  std::uint64_t connections = 0;
  wire::LinkFault fault = wire::LinkFault::None;  ///< of the last failed attempt
};

/// The names of the clients' settings in explanations.
inline wire::LinkWords words_of(const char* setting) { return {setting, "server_key", "secret_key", "timeout"}; }

/// The enum mocap_diagnosis of a fault of the connection.
std::int32_t diagnosis_of(wire::LinkFault fault);

struct FeedSettings {
  std::string endpoint;
  std::string topic;
  int axes = MOCAP_AXES_MOCAP;
  std::size_t keep = 1;  ///< number of retained frames, at least 1
  std::uint64_t id = 1;  ///< identity of the client
};

struct Diagnosis {
  std::int32_t code = MOCAP_WELL;
  std::string sentence;  ///< the fault and a remedy
};

/// The state of a feed, computed from its messages. Performs no input or output and reads no clock: `now` is an
/// argument. One thread at a time.
class Feed {
 public:
  explicit Feed(const FeedSettings& settings);

  /// Processes one untrusted message: topic, zero byte, Protobuf.
  void take(std::string_view message, Now now);
  void note(const Link& link) { link_ = link; }

  /// Copies the next frame to `into`. Returns false if there is no newer frame. Allocates only if `into` must grow.
  bool hand_out(Frame& into, Now now);

  /// The newest health report; nullptr if none has arrived.
  const std::shared_ptr<const Health>& health() const { return health_; }

  /// Copies the oldest event that was not returned yet. Returns false if there is none.
  bool next_event(mocap_event& into);

  mocap_statistics statistics(Now now) const;
  Diagnosis diagnose(Now now) const;

 private:
  static constexpr std::size_t kRates = 1024;
  static constexpr std::size_t kAges = 2048;

  void take_snapshot(std::string_view bytes, Now now);
  void take_description(std::string_view bytes);
  void take_health(std::string_view bytes);
  void take_event(std::string_view bytes);
  void count(const mocap_frame_info& info, Now now);
  void change_axes(Frame& frame) const;
  void note_transit(const mocap_frame_info& info, Now now);
  Diagnosis why_not_connected() const;
  Diagnosis why_no_snapshots(Now now) const;
  std::string cameras_without_images() const;
  bool capture_ended() const;
  std::string missing_subjects() const;
  bool skewed(Now now) const;

  FeedSettings settings_;
  std::string prefix_;
  Axes axes_;
  bool local_;
  Link link_;
  std::shared_ptr<const Description> description_;
  std::shared_ptr<const Health> health_;
  std::deque<mocap_event> events_;
  std::string foreign_protocol_;  // name of an unknown protocol; empty if the protocol is known
  const char* last_fault_ = nullptr;
  Frame scratch_;
  std::vector<Frame> ring_;  // the newest `keep` frames
  std::uint64_t serial_ = 0;
  std::uint64_t handed_out_ = 0;  // newest serial number returned to any caller
  mocap_statistics counts_{};
  std::uint64_t next_sequence_ = 0;
  bool counted_ = false;
  std::int64_t last_frame_ns_ = 0;
  bool tracking_ = false;
  bool any_subject_ = false;
  std::array<std::int64_t, kRates> arrivals_{};
  std::array<std::int64_t, kAges> ages_{};
  std::size_t age_count_ = 0;
  // Shortest transit time in the current and in the previous second. The minimum excludes delays that the clocks do not
  // cause.
  std::int64_t transit_since_ns_ = 0;
  std::int64_t transit_ns_ = MOCAP_ABSENT;
  std::int64_t transit_before_ns_ = MOCAP_ABSENT;
};

/// Whether the endpoint is on this machine, so that both programs have the same monotonic clock.
bool is_local(std::string_view endpoint);

/// Time from the exposure to now; MOCAP_ABSENT if the clocks cannot be compared.
std::int64_t age_of(const Frame& frame, Now now);

}  // namespace mocap::client
