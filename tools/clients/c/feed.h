#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "axes.h"
#include "frame.h"

namespace mocap::client {

/// An instant on this host's clocks, ns.
struct Now {
  std::int64_t host_ns = 0;  ///< monotonic
  std::int64_t utc_ns = 0;
};

/// What is known of the connection.
struct Link {
  bool connected = false;     ///< the handshake is through
  std::int64_t since_ns = 0;  ///< when `connected` last changed, or when it was opened
  std::uint64_t connections = 0;
  std::uint64_t refused = 0;            ///< attempts that found nobody, since the last connection
  std::int32_t handshake = MOCAP_WELL;  ///< why the last handshake failed: an enum mocap_diagnosis
};

struct FeedSettings {
  std::string endpoint;
  std::string topic;
  int axes = MOCAP_AXES_MOCAP;
  std::size_t keep = 1;  ///< frames, at least 1
  std::uint64_t id = 1;  ///< of the client
  bool has_keys = false;
};

struct Diagnosis {
  std::int32_t code = MOCAP_WELL;
  std::string sentence;  ///< what is wrong, and what helps
};

/// What came over the wire, and what follows from it. Opens nothing and reads no clock: `now` is an argument. One
/// thread at a time.
class Feed {
 public:
  explicit Feed(const FeedSettings& settings);

  /// Takes one message (topic, zero byte, Protobuf) that may come from anybody.
  void take(std::string_view message, Now now);
  void note(const Link& link) { link_ = link; }

  /// Puts the next frame into `into`; false when there is none newer. Allocates only while `into` grows.
  bool hand_out(Frame& into, Now now);

  mocap_statistics statistics(Now now) const;
  Diagnosis diagnose(Now now) const;

 private:
  static constexpr std::size_t kRates = 1024;
  static constexpr std::size_t kAges = 2048;

  void take_snapshot(std::string_view bytes, Now now);
  void take_description(std::string_view bytes);
  void take_health(std::string_view bytes);
  void count(const mocap_frame_info& info, Now now);
  void change_axes(Frame& frame) const;
  void note_transit(const mocap_frame_info& info, Now now);
  Diagnosis why_not_connected() const;
  Diagnosis why_nothing_comes(Now now) const;
  std::string cameras_without_images() const;
  bool skewed(Now now) const;

  FeedSettings settings_;
  std::string prefix_;
  Axes axes_;
  bool local_;
  Link link_;
  std::shared_ptr<const Description> description_;
  Health health_;
  std::string foreign_protocol_;  // of a feed that is not ours; empty: none
  const char* last_fault_ = nullptr;
  Frame scratch_;
  std::vector<Frame> ring_;  // the newest `keep`
  std::uint64_t serial_ = 0;
  std::uint64_t handed_out_ = 0;  // the newest serial that anybody got
  mocap_statistics counts_{};
  std::uint64_t next_sequence_ = 0;
  bool counted_ = false;
  std::int64_t last_frame_ns_ = 0;
  bool tracking_ = false;
  bool any_subject_ = false;
  std::array<std::int64_t, kRates> arrivals_{};
  std::array<std::int64_t, kAges> ages_{};
  std::size_t age_count_ = 0;
  // The quickest way of a message within the present and the last second: what is late is no matter of clocks.
  std::int64_t transit_since_ns_ = 0;
  std::int64_t transit_ns_ = MOCAP_ABSENT;
  std::int64_t transit_before_ns_ = MOCAP_ABSENT;
};

/// Only programs of this machine can be reached so, and their monotonic clock is this one's.
bool is_local(std::string_view endpoint);

/// Exposure to now; MOCAP_ABSENT where the clocks cannot be compared.
std::int64_t age_of(const Frame& frame, Now now);

}  // namespace mocap::client
