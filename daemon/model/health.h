#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/audit.h"
#include "model/blob_use.h"
#include "model/clock/clock_source.h"
#include "model/clock/timecode_health.h"
#include "model/detection_counts.h"
#include "model/search_health.h"
#include "model/take/take_health.h"

namespace mocap {

/// The stages between two successive instants, in the order of Instants.
enum class LatencyStage { Receive, Detect, Fuse, Send, Total };
inline constexpr std::size_t kLatencyStages = 5;

/// Latencies of the last second; all zero if nothing passed.
struct LatencyFigures {
  std::uint64_t count = 0;
  Duration p50{};
  Duration p99{};
  Duration max{};
};

/// Upper ends of the buckets of LatencyTotals; a latency above the last one is in the bucket after it.
inline constexpr std::array<Duration, 15> kLatencyBounds = [] {
  constexpr int kBounds_us[] = {250,   500,   1000,  2000,  3000,  4000,   6000,  8000,
                                12000, 16000, 24000, 32000, 64000, 128000, 256000};
  std::array<Duration, 15> bounds{};
  for (std::size_t i = 0; i < bounds.size(); ++i) bounds[i] = std::chrono::microseconds(kBounds_us[i]);
  return bounds;
}();

/// Latencies since the start.
struct LatencyTotals {
  std::array<std::uint64_t, kLatencyBounds.size() + 1> counts{};  ///< snapshots by bucket
  Duration sum{};
};

enum class CameraPhase { Starting, Streaming, Silent, Reopening, Ended, Stopped };

/// Counts of one camera since the start, and its state.
struct CameraHealth {
  std::string name;
  CameraPhase phase = CameraPhase::Starting;
  double rate_hz = 0.0;  ///< over the last second
  std::uint64_t frames = 0;
  std::uint64_t missing_frames = 0;  ///< gaps in the camera's frame numbers
  std::uint64_t failed_frames = 0;   ///< arrived, but unusable
  std::uint64_t dropped_queue_full = 0;
  std::uint64_t reopened = 0;
  std::uint64_t underruns = 0;        ///< images that arrived when every buffer was in use
  std::uint64_t resent_packets = 0;   ///< lost, requested again and received
  std::uint64_t missing_packets = 0;  ///< never received
  std::string last_error;             ///< empty when none
  DetectionCounts detection;
  DetectionLevels levels;
  bool synchronised = true;           ///< exposes together with most other cameras; also true while unknown
  double offset_us = 0.0;             ///< offset of its exposures from the mean of the synchronised cameras
  double drift_us_s = 0.0;            ///< rate of change of the offset
  double jitter_us = 0.0;             ///< standard deviation of the offset about its drift
  std::uint64_t repeated_frames = 0;  ///< received twice, and dropped
  std::uint64_t clock_leaps = 0;      ///< the camera's clock wrapped, jumped, ran backwards or stopped
  double clock_uncertainty_us = 0.0;  ///< standard deviation of its exposure times on the host's clock; 0: unknown
  bool bumped = false;                ///< its pose differs from the rig, judged by the other cameras
  double rig_off_px =
      0.0;  ///< rms length of the residuals that a rotation and translation of the camera explain; 0: unknown
  double rig_turned_rad = 0.0;
  double rig_moved_m = 0.0;
  ClockSource clock_source = ClockSource::Unknown;
  bool chunk_times = false;  ///< the camera writes the start of each exposure into the image
  BlobUse blob_use;
  std::optional<double> marker_share = std::nullopt;  ///< BlobUse::share() over the last second
};

/// Connections of the feed. `listeners`, `subscriptions` and `behind` are current; the others count since the start.
struct FeedHealth {
  std::uint32_t listeners = 0;  ///< connected subscribers, after the handshake
  std::uint64_t connections = 0;
  std::uint64_t disconnections = 0;
  std::uint64_t failed_handshakes = 0;
  std::uint64_t refused_clients = 0;  ///< refused because their key is not allowed
  std::uint64_t cut_off = 0;          ///< disconnected: too many subscriptions or connections, or a revoked key
  std::uint32_t subscriptions = 0;    ///< topics with a subscriber
  std::uint64_t failed_accepts = 0;   ///< no file descriptor was free
  std::uint32_t behind = 0;           ///< connections that do not read the messages sent to them
};

enum class RecordingState {
  Recording,
  Ended,   ///< the file is complete
  Failed,  ///< a write failed; the file ends with its last whole record
};

/// A file that the daemon writes.
struct RecordingHealth {
  std::string path;
  RecordingState state = RecordingState::Recording;
  std::uint64_t size_bytes = 0;
  std::uint64_t records = 0;  ///< snapshots or images
  std::string error;          ///< empty unless failed
};

/// Health of the service, published once a second.
struct Health {
  Timestamp at;
  double set_rate_hz = 0.0;
  std::uint64_t sets = 0;
  std::uint64_t complete_sets = 0;
  std::uint64_t passed_over_sets = 0;       ///< sets skipped: newer images of all their cameras waited
  std::uint64_t dropped_snapshots = 0;      ///< dropped because the publish queue was full
  std::uint64_t passed_over_snapshots = 0;  ///< skipped because the publisher was late and took the newest
  std::uint64_t sent_snapshots = 0;
  std::array<LatencyFigures, kLatencyStages> latency;        ///< by LatencyStage
  std::array<LatencyTotals, kLatencyStages> latency_totals;  ///< by LatencyStage
  std::vector<CameraHealth> cameras;
  FeedHealth feed;
  std::vector<RecordingHealth> recordings;
  TakeHealth take;                     ///< the take that is recorded, or the last one
  std::vector<SearchHealth> searches;  ///< subjects that are not found, with the reason
  TimecodeHealth timecode;             ///< the source of timecode, if there is one
  AuditHealth audit;                   ///< the audit log
};

}  // namespace mocap
