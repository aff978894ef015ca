#include "web/metrics/metrics.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "base/expects.h"
#include "web/metrics/metric_table.h"

namespace mocap::web {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

// A message whose fields are metrics, with the label of its samples ({camera="north"}, or empty).
struct Labelled {
  std::string labels;
  const Message* message = nullptr;
};

std::string label(std::string_view name, std::string_view value) {
  std::string escaped;
  for (const char c : value) {
    if (c == '\n') {
      escaped += "\\n";
    } else {
      if (c == '\\' || c == '"') escaped += '\\';
      escaped += c;
    }
  }
  return fmt::format("{{{}=\"{}\"}}", name, escaped);
}

std::optional<double> number_in(const Message& message, std::string_view field) {
  const FieldDescriptor* found = message.GetDescriptor()->FindFieldByName(std::string(field));
  MOCAP_EXPECTS(found != nullptr);  // a test reads every metric of the tables
  const auto& in = *message.GetReflection();
  if (found->has_presence() && !in.HasField(message, found)) return std::nullopt;
  switch (found->cpp_type()) {
    case FieldDescriptor::CPPTYPE_UINT32: return in.GetUInt32(message, found);
    case FieldDescriptor::CPPTYPE_UINT64: return static_cast<double>(in.GetUInt64(message, found));
    case FieldDescriptor::CPPTYPE_INT64: return static_cast<double>(in.GetInt64(message, found));
    case FieldDescriptor::CPPTYPE_DOUBLE: return in.GetDouble(message, found);
    case FieldDescriptor::CPPTYPE_BOOL: return in.GetBool(message, found) ? 1.0 : 0.0;
    default: MOCAP_EXPECTS(false);
  }
  return std::nullopt;
}

std::string_view word_of(MetricKind kind) {
  switch (kind) {
    case MetricKind::Counter: return "counter";
    case MetricKind::Gauge: return "gauge";
    case MetricKind::Histogram: break;
  }
  return "histogram";
}

class Text {
 public:
  void head(std::string_view name, MetricKind kind, std::string_view help) {
    text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, word_of(kind));
  }
  void sample(std::string_view name, std::string_view labels, double value) {
    text_ += fmt::format("{}{} {}\n", name, labels, value);
  }
  void one(std::string_view name, MetricKind kind, double value, std::string_view help) {
    head(name, kind, help);
    sample(name, "", value);
  }
  void add(std::span<const Metric> metrics, const std::vector<Labelled>& messages) {
    if (messages.empty()) return;
    for (const Metric& metric : metrics) {
      head(metric.name, metric.kind, metric.help);
      for (const Labelled& each : messages) {
        if (const auto value = number_in(*each.message, metric.field))
          sample(metric.name, each.labels, *value * metric.scale);
      }
    }
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

// "LATENCY_STAGE_FUSE" -> "fuse"
std::string word(std::string name, std::string_view prefix) {
  name.erase(0, std::min(name.size(), prefix.size()));
  for (char& c : name) c = static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c);
  return name;
}

// Histograms: the count of a bucket includes those below it.
void add_latency_totals(Text& text, const v1::Health& health) {
  if (health.latency_totals().empty()) return;
  constexpr std::string_view kName = "mocap_latency_seconds";
  text.head(kName, MetricKind::Histogram, "Latency of the stage, since the start.");
  for (const v1::LatencyTotals& stage : health.latency_totals()) {
    const std::string name = word(v1::LatencyStage_Name(stage.stage()), "LATENCY_STAGE_");
    double below = 0.0;
    for (int i = 0; i < stage.counts_size(); ++i) {
      below += static_cast<double>(stage.counts(i));
      const bool last = i >= health.latency_bounds_s_size();
      const std::string end = last ? "+Inf" : fmt::format("{}", health.latency_bounds_s(i));
      text.sample(fmt::format("{}_bucket", kName), fmt::format("{{stage=\"{}\",le=\"{}\"}}", name, end), below);
      if (last) break;
    }
    text.sample(fmt::format("{}_sum", kName), label("stage", name), stage.sum_s());
    text.sample(fmt::format("{}_count", kName), label("stage", name), below);
  }
}

void add_cameras(Text& text, const v1::Health& health) {
  std::vector<Labelled> cameras;
  for (const v1::CameraHealth& camera : health.cameras()) cameras.push_back({label("camera", camera.name()), &camera});
  text.add(camera_metrics(), cameras);
  if (cameras.empty()) return;
  text.head("mocap_camera_streaming", MetricKind::Gauge, "1: images arrive.");
  for (const v1::CameraHealth& camera : health.cameras()) {
    text.sample("mocap_camera_streaming", label("camera", camera.name()),
                camera.phase() == v1::CAMERA_PHASE_STREAMING ? 1 : 0);
  }
  text.head("mocap_camera_clock_locked", MetricKind::Gauge,
            "0: the camera's clock should be synchronised (PTP) and is not.");
  for (const v1::CameraHealth& camera : health.cameras()) {
    text.sample("mocap_camera_clock_locked", label("camera", camera.name()),
                camera.clock_source() == v1::CLOCK_SOURCE_LOST ? 0 : 1);
  }
}

void add_subjects(Text& text, const v1::Health& health, const v1::Description& description) {
  if (description.subjects().empty()) return;
  text.head("mocap_subject_searched", MetricKind::Gauge, "1: the subject is searched for and not found.");
  for (int i = 0; i < description.subjects_size(); ++i) {
    const bool searched = std::ranges::any_of(health.searches(), [&](const v1::SearchHealth& search) {
      return search.subject() == static_cast<std::uint32_t>(i);
    });
    text.sample("mocap_subject_searched", label("subject", description.subjects(i).name()), searched ? 1 : 0);
  }
}

void add_health(Text& text, const v1::Health& health) {
  text.add(health_metrics(), {{"", &health}});
  std::vector<Labelled> stages;
  for (const v1::StageLatency& stage : health.latencies()) {
    stages.push_back({label("stage", word(v1::LatencyStage_Name(stage.stage()), "LATENCY_STAGE_")), &stage});
  }
  text.add(latency_metrics(), stages);
  add_latency_totals(text, health);
  add_cameras(text, health);
  if (health.has_feed()) text.add(feed_metrics(), {{"", &health.feed()}});
  std::vector<Labelled> recordings;
  for (const v1::RecordingHealth& each : health.recordings()) recordings.push_back({label("path", each.path()), &each});
  text.add(recording_metrics(), recordings);
  if (!health.has_take()) return;
  text.add(take_metrics(), {{"", &health.take()}});
  text.one("mocap_take_recording", MetricKind::Gauge, health.take().state() == v1::TAKE_STATE_RECORDING ? 1 : 0,
           "1: a take is being recorded.");
  text.one("mocap_take_failed", MetricKind::Gauge, health.take().state() == v1::TAKE_STATE_FAILED ? 1 : 0,
           "1: the last take ended early.");
}

void add_own(Text& text, const WebCounts& counts) {
  using enum MetricKind;
  const auto number = [](std::uint64_t count) { return static_cast<double>(count); };
  text.one("mocap_web_viewers", Gauge, number(counts.viewers), "Pages that are connected.");
  text.one("mocap_web_requests_total", Counter, number(counts.requests), "HTTP requests answered.");
  text.one("mocap_web_changes_total", Counter, number(counts.changes), "Requests that change the daemon's state.");
  text.one("mocap_web_messages_total", Counter, number(counts.messages), "WebSocket messages sent to pages.");
  text.one("mocap_web_sent_bytes_total", Counter, number(counts.bytes), "Bytes of the WebSocket messages.");
  text.one("mocap_web_dropped_snapshots_total", Counter, number(counts.dropped_snapshots),
           "Snapshots replaced by a newer one before a page could receive them.");
  text.head("mocap_web_refused_total", Counter, "Connections and requests refused or cut, by reason.");
  for (const auto& [reason, count] : counts.refused)
    text.sample("mocap_web_refused_total", label("reason", reason), number(count));
}

}  // namespace

std::string metrics_text(const MetricsInput& input) {
  Text text;
  text.one("mocap_up", MetricKind::Gauge, input.connected && input.health != nullptr ? 1 : 0,
           "1: the daemon sends its feed.");
  if (input.health != nullptr) {
    text.one("mocap_feed_age_seconds", MetricKind::Gauge, input.age_s, "Time since the last message of the feed.");
    add_health(text, *input.health);
  }
  if (input.health != nullptr && input.description != nullptr) add_subjects(text, *input.health, *input.description);
  add_own(text, input.counts);
  return text.take();
}

bool is_metric(std::string_view message, std::string_view field) {
  const auto has = [&](std::span<const Metric> metrics) {
    return std::ranges::any_of(metrics, [&](const Metric& metric) { return metric.field == field; });
  };
  if (message == "Health") return has(health_metrics());
  if (message == "CameraHealth") return has(camera_metrics());
  if (message == "FeedHealth") return has(feed_metrics());
  if (message == "TakeHealth") return has(take_metrics());
  if (message == "RecordingHealth") return has(recording_metrics());
  return message == "StageLatency" && has(latency_metrics());
}

}  // namespace mocap::web
