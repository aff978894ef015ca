#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"

namespace mocap::web {

/// Counts of this program since its start.
struct WebCounts {
  std::uint64_t requests = 0;                         ///< HTTP requests that were answered
  std::uint64_t changes = 0;                          ///< requests that change the daemon's state
  std::uint64_t messages = 0;                         ///< WebSocket messages to pages
  std::uint64_t bytes = 0;                            ///< of these messages
  std::uint64_t dropped_snapshots = 0;                ///< replaced by a newer one before a page could receive it
  std::uint64_t viewers = 0;                          ///< pages connected now
  std::map<std::string, std::uint64_t> refused = {};  ///< connections and requests refused or cut, by reason
};

/// The facts that the metrics show. Null: not received yet.
struct MetricsInput {
  bool connected = false;
  double age_s = 0.0;  ///< since the last message of the feed
  const v1::Health* health = nullptr;
  const v1::Description* description = nullptr;
  WebCounts counts = {};
};

/// Media type of Prometheus' text format.
inline constexpr std::string_view kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

/// All figures of health and of this program in Prometheus' text format, each with unit and help. A field that is
/// absent gives no sample.
std::string metrics_text(const MetricsInput& input);

/// Whether the metrics have this field of Health, CameraHealth, FeedHealth, TakeHealth, RecordingHealth or
/// StageLatency; for the test that no counter is forgotten.
bool is_metric(std::string_view message, std::string_view field);

}  // namespace mocap::web
