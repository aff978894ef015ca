#pragma once

#include <span>
#include <string_view>

namespace mocap::web {

enum class MetricKind { Counter, Gauge, Histogram };

/// A numeric field of a Protobuf message as a metric of Prometheus: base units, counters end in _total.
struct Metric {
  std::string_view field;
  std::string_view name;
  MetricKind kind = MetricKind::Counter;
  double scale = 1.0;  ///< from the unit of the field to the unit in the name
  std::string_view help;
};

std::span<const Metric> health_metrics();
std::span<const Metric> camera_metrics();  ///< label camera
std::span<const Metric> feed_metrics();
std::span<const Metric> take_metrics();
std::span<const Metric> recording_metrics();  ///< label path
std::span<const Metric> latency_metrics();    ///< label stage

}  // namespace mocap::web
