#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/clock_source.h"
#include "model/detection_counts.h"

namespace mocap {

/// The ways from one instant to the next, in the order of Instants.
enum class LatencyStage { Receive, Detect, Fuse, Send, Total };
inline constexpr std::size_t kLatencyStages = 5;

/// Of the last reporting second; zero counts when nothing passed.
struct LatencyFigures {
  std::uint64_t count = 0;
  Duration p50{};
  Duration p99{};
  Duration max{};
};

enum class CameraPhase { Starting, Streaming, Silent, Reopening, Ended, Stopped };

/// One camera's counts since the start, and its state.
struct CameraHealth {
  std::string name;
  CameraPhase phase = CameraPhase::Starting;
  double rate_hz = 0.0;  ///< over the last second
  std::uint64_t frames = 0;
  std::uint64_t missing_frames = 0;  ///< gaps in the camera's own count
  std::uint64_t failed_frames = 0;   ///< came, and were unusable
  std::uint64_t dropped_queue_full = 0;
  std::uint64_t reopened = 0;
  std::uint64_t underruns = 0;        ///< images that came when every buffer was in use
  std::uint64_t resent_packets = 0;   ///< were lost, asked for again and came
  std::uint64_t missing_packets = 0;  ///< never came
  std::string last_error;             ///< empty when none
  DetectionCounts detection;
  DetectionLevels levels;
  bool synchronised = true;           ///< exposes with most others; true too where that is not known yet
  double offset_us = 0.0;             ///< its exposures after the mean of those that expose together
  double drift_us_s = 0.0;            ///< how that grows
  double jitter_us = 0.0;             ///< standard deviation of the offset about its drift
  std::uint64_t repeated_frames = 0;  ///< came a second time, and were left out
  std::uint64_t clock_leaps = 0;      ///< its clock wrapped, leapt, ran back or stood still
  double clock_uncertainty_us = 0.0;  ///< standard deviation of its exposures on the host's clock; 0: not told
  bool bumped = false;                ///< it stands otherwise than the rig says, as the other cameras see it
  double rig_off_px = 0.0;            ///< how far off its views are on the whole, by such a turn and move; 0: not told
  double rig_turned_rad = 0.0;
  double rig_moved_m = 0.0;
  ClockSource clock_source = ClockSource::Unknown;
  bool chunk_times = false;  ///< it writes each exposure's begin into the image
};

/// The feed's own side of its connections. All but the first and the last but one run since the start.
struct FeedHealth {
  std::uint32_t listeners = 0;  ///< connected now, the handshake through
  std::uint64_t connections = 0;
  std::uint64_t disconnections = 0;
  std::uint64_t failed_handshakes = 0;
  std::uint64_t refused_clients = 0;  ///< whose key is not allowed
  std::uint64_t cut_off = 0;          ///< by us: too many subscriptions or connections, a key that was revoked
  std::uint32_t subscriptions = 0;    ///< topics that somebody listens to
  std::uint64_t failed_accepts = 0;   ///< no file descriptor was free
  std::uint32_t behind = 0;           ///< connections that do not take what they are sent, now
};

/// How the service is, once a second.
struct Health {
  Timestamp at;
  double set_rate_hz = 0.0;
  std::uint64_t sets = 0;
  std::uint64_t complete_sets = 0;
  std::uint64_t passed_over_sets = 0;       ///< a newer set was waiting
  std::uint64_t dropped_snapshots = 0;      ///< the publish queue was full
  std::uint64_t passed_over_snapshots = 0;  ///< the publisher was late and took the newest
  std::uint64_t sent_snapshots = 0;
  std::array<LatencyFigures, kLatencyStages> latency;  ///< by LatencyStage
  std::vector<CameraHealth> cameras;
  FeedHealth feed;
};

}  // namespace mocap
