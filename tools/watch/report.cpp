#include "watch/report.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <numbers>

#include "lib/cli/shown_text.h"
#include "watch/idle_cameras.h"

namespace mocap::watch {
namespace {

constexpr Duration kSilent = std::chrono::seconds(1);
constexpr std::array<const char*, kLatencyStages> kStageNames = {"receive", "detect", "fuse", "send", "total"};

const char* word_of(SubjectPhase phase) {
  switch (phase) {
    case SubjectPhase::Searching: return "searching";
    case SubjectPhase::Tracking: return "tracking";
    case SubjectPhase::Lost: return "lost";
  }
  return "unknown";
}

const char* word_of(ClockSource source) {
  switch (source) {
    case ClockSource::Receipts: return "receipts";
    case ClockSource::Camera: return "camera";
    case ClockSource::Lost: return "lost";
    case ClockSource::Ptp: return "ptp";
    case ClockSource::Unknown: break;
  }
  return "unknown";
}

const char* word_of(CameraPhase phase) {
  switch (phase) {
    case CameraPhase::Starting: return "starting";
    case CameraPhase::Streaming: return "streaming";
    case CameraPhase::Silent: return "silent";
    case CameraPhase::Reopening: return "reopening";
    case CameraPhase::Ended: return "ended";
    case CameraPhase::Stopped: return "stopped";
  }
  return "unknown";
}

const char* word_of(RecordingState state) {
  switch (state) {
    case RecordingState::Recording: return "recording";
    case RecordingState::Ended: return "ended";
    case RecordingState::Failed: return "failed";
  }
  return "unknown";
}

double ms(Duration span) { return to_us(span) / 1000.0; }

std::string subjects_of(const FeedState& feed) {
  std::string text;
  const auto& phases = feed.last()->phases;
  for (std::size_t i = 0; i < phases.size(); ++i) {
    const bool known = feed.description() && i < feed.description()->subjects.size();
    text += fmt::format(" {}={}", known ? feed.description()->subjects[i].name : fmt::format("subject {}", i),
                        word_of(phases[i]));
  }
  return text.empty() ? " no subject" : text;
}

std::string latencies_of(const FeedState& feed) {
  if (!feed.health()) return " | latency unknown yet";
  std::string text = " | ms p50/p99/max";
  for (std::size_t i = 0; i < kLatencyStages; ++i) {
    const LatencyFigures& f = feed.health()->latency[i];
    if (f.count > 0) text += fmt::format(" {} {:.1f}/{:.1f}/{:.1f}", kStageNames[i], ms(f.p50), ms(f.p99), ms(f.max));
  }
  return text;
}

// The total latency only, for narrow terminals.
std::string total_latency_of(const FeedState& feed) {
  if (!feed.health()) return {};
  const LatencyFigures& f = feed.health()->latency[static_cast<std::size_t>(LatencyStage::Total)];
  return fmt::format(" | {:.1f}/{:.1f}/{:.1f} ms", ms(f.p50), ms(f.p99), ms(f.max));
}

std::uint64_t drops_of(const Health& health) {
  std::uint64_t drops = health.passed_over_sets + health.dropped_snapshots + health.passed_over_snapshots;
  for (const CameraHealth& camera : health.cameras) {
    drops += camera.missing_frames + camera.failed_frames + camera.dropped_queue_full;
  }
  return drops;
}

// Lists the cameras that stream but find no blobs, with the reason: "cam1: 0 blobs in 60 images: 212 too small
// (threshold 38 grey)".
std::string blind_cameras(const FeedState& feed) {
  if (!feed.health() || !feed.health_before()) return {};
  std::string text;
  for (std::size_t i = 0; i < feed.health()->cameras.size(); ++i) {
    const CameraHealth& now = feed.health()->cameras[i];
    const CameraHealth& before = feed.health_before()->cameras[i];
    if (now.frames < before.frames) continue;
    const std::string why = why_no_blobs(now.frames - before.frames, now.detection.since(before.detection), now.levels);
    if (!why.empty()) text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", now.name, why);
  }
  return text;
}

// Lists the cameras that do not stream, with their phase and error.
std::string silent_cameras(const Health& health) {
  std::string text;
  for (const CameraHealth& camera : health.cameras) {
    if (camera.phase == CameraPhase::Streaming) continue;
    text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", camera.name, word_of(camera.phase),
                        camera.last_error.empty() ? "" : " (" + camera.last_error + ")");
  }
  return text;
}

// Lists the cameras whose pose deviates from the rig.
std::string bumped_cameras(const Health& health) {
  std::string text;
  for (const CameraHealth& camera : health.cameras) {
    if (!camera.bumped) continue;
    text += fmt::format("{}{} was moved: {:.1f} px off", text.empty() ? "" : ", ", camera.name, camera.rig_off_px);
  }
  return text;
}

// The daemon's reasons why subjects are not found, one sentence each.
std::string missing_subjects(const Health& health) {
  std::string text;
  for (const SearchHealth& search : health.searches) {
    text += fmt::format("{}{}", text.empty() ? "" : "; ", text_of(search.sentence));
  }
  return text;
}

// "10:00:00:00 locked", or why there is no timecode; empty: the daemon has no source of timecode.
std::string timecode_of(const Health& health) {
  const TimecodeHealth& timecode = health.timecode;
  if (timecode.source == TimecodeSourceKind::None) return {};
  const auto now = timecode.clock ? timecode_at(*timecode.clock, health.at) : std::nullopt;
  if (!timecode.sentence.empty()) return std::string(text_of(timecode.sentence));
  return now ? fmt::format("timecode {}", text_of(*now)) : "no timecode";
}

// Lists the recordings of which a write failed.
std::string failed_recordings(const Health& health) {
  std::string text;
  for (const RecordingHealth& recording : health.recordings) {
    if (recording.state != RecordingState::Failed) continue;
    text += fmt::format("{}{}", text.empty() ? "" : ", ", recording.error);
  }
  return text;
}

}  // namespace

std::string status_line(const FeedState& feed, Timestamp now, std::size_t columns) {
  if (!feed.last()) return std::string("waiting for the first snapshot").substr(0, columns);
  const LastSnapshot& last = *feed.last();
  std::string line = fmt::format("{:5.1f} Hz | cameras {} of {} | markers {} of {}", feed.rate_hz(now), last.views,
                                 last.expected_views, last.labelled, last.labels);
  if (last.unlabelled > 0) line += fmt::format(" +{}", last.unlabelled);
  line += " |" + subjects_of(feed);
  if (feed.health() && !missing_subjects(*feed.health()).empty()) line += " | " + missing_subjects(*feed.health());
  if (const auto age = feed.age(0.5)) line += fmt::format(" | age {:.1f} ms", ms(*age));
  line += fmt::format(" | lost {}", feed.lost());
  if (feed.health()) line += fmt::format(" drops {}", drops_of(*feed.health()));
  if (const std::string blind = blind_cameras(feed); !blind.empty()) line += " | " + blind;
  if (const std::string idle = idle_cameras(feed); !idle.empty()) line += " | " + idle;
  if (feed.health() && !bumped_cameras(*feed.health()).empty()) line += " | " + bumped_cameras(*feed.health());
  if (feed.health() && !timecode_of(*feed.health()).empty()) line += " | " + timecode_of(*feed.health());
  if (feed.health() && !failed_recordings(*feed.health()).empty()) line += " | " + failed_recordings(*feed.health());
  if (feed.unreadable() > 0) line += fmt::format(" unreadable {} ({})", feed.unreadable(), feed.last_fault());
  for (const std::string& latency : {latencies_of(feed), total_latency_of(feed)}) {
    if (line.size() + latency.size() <= columns) return cli::shown(line + latency, columns);
  }
  return cli::shown(line, columns);
}

std::string reason_for_silence(const FeedState& feed, const wire::LinkStatus& link, const std::string& endpoint,
                               Duration silent_for) {
  std::string reason;
  if (!link.connected && link.fault != wire::LinkFault::None) {
    reason = wire::explain(link.fault, endpoint, {"[publish] endpoint"});
  } else if (!link.connected) {
    reason = link.connections > 0 ? "the connection was lost, trying again"
                                  : "nothing answers at this address: check the address, the network and firewalls";
  } else if (feed.unreadable() > 0 && feed.frames() == 0) {
    reason = "the messages cannot be read: " + feed.last_fault();
  } else if (!feed.description() && !feed.health()) {
    reason = "connected, but nothing was received yet";
  } else if (feed.health() && !silent_cameras(*feed.health()).empty()) {
    reason = "cameras: " + silent_cameras(*feed.health());
  } else {
    reason = "connected, but the daemon sends no snapshots";
  }
  return fmt::format("no data from {} for {:.0f} s: {}", endpoint, std::max(to_s(silent_for), to_s(kSilent)), reason);
}

namespace {

nlohmann::ordered_json latency_object(const Health& health) {
  nlohmann::ordered_json all = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < kLatencyStages; ++i) {
    const LatencyFigures& f = health.latency[i];
    if (f.count == 0) continue;
    all[kStageNames[i]] = {{"p50_ms", ms(f.p50)}, {"p99_ms", ms(f.p99)}, {"max_ms", ms(f.max)}};
  }
  return all;
}

nlohmann::ordered_json camera_object(const CameraHealth& camera) {
  return {{"phase", word_of(camera.phase)},
          {"rate_hz", camera.rate_hz},
          {"frames", camera.frames},
          {"missing_frames", camera.missing_frames},
          {"failed_frames", camera.failed_frames},
          {"dropped_queue_full", camera.dropped_queue_full},
          {"blobs", camera.detection.blobs},
          {"blobs_too_small", camera.detection.too_small},
          {"blobs_too_large", camera.detection.too_large},
          {"blobs_not_round", camera.detection.not_round},
          {"blobs_too_dim", camera.detection.too_dim},
          {"blobs_dropped", camera.detection.dropped},
          {"rows_given_up", camera.detection.rows_given_up},
          {"threshold_grey", camera.levels.threshold_grey},
          {"noise_grey", camera.levels.noise_grey},
          {"background_grey", camera.levels.background_grey},
          {"brightest_grey", camera.levels.brightest_grey},
          {"reopened", camera.reopened},
          {"resent_packets", camera.resent_packets},
          {"missing_packets", camera.missing_packets},
          {"repeated_frames", camera.repeated_frames},
          {"last_error", camera.last_error},
          {"synchronised", camera.synchronised},
          {"offset_us", camera.offset_us},
          {"drift_us_s", camera.drift_us_s},
          {"jitter_us", camera.jitter_us},
          {"clock_leaps", camera.clock_leaps},
          {"clock_uncertainty_us", camera.clock_uncertainty_us},
          {"clock_source", word_of(camera.clock_source)},
          {"chunk_times", camera.chunk_times},
          {"fused_blobs", camera.blob_use.blobs},
          {"marker_blobs", camera.blob_use.in_markers},
          {"marker_share", camera.marker_share ? nlohmann::ordered_json(*camera.marker_share) : nullptr},
          {"bumped", camera.bumped},
          {"rig_off_px", camera.rig_off_px},
          {"rig_turned_deg", camera.rig_turned_rad * 180.0 / std::numbers::pi},
          {"rig_moved_mm", 1e3 * camera.rig_moved_m}};
}

nlohmann::ordered_json feed_object(const FeedHealth& feed) {
  return {{"listeners", feed.listeners},
          {"behind", feed.behind},
          {"connections", feed.connections},
          {"disconnections", feed.disconnections},
          {"failed_handshakes", feed.failed_handshakes},
          {"refused_clients", feed.refused_clients},
          {"cut_off", feed.cut_off},
          {"failed_accepts", feed.failed_accepts},
          {"subscriptions", feed.subscriptions}};
}

const char* word_of(TimecodeState state) {
  switch (state) {
    case TimecodeState::Searching: return "searching";
    case TimecodeState::Locked: return "locked";
    case TimecodeState::Coasting: return "coasting";
    case TimecodeState::Lost: return "lost";
  }
  return "unknown";
}

nlohmann::ordered_json timecode_object(const Health& health) {
  const TimecodeHealth& timecode = health.timecode;
  const auto now = timecode.clock ? timecode_at(*timecode.clock, health.at) : std::nullopt;
  nlohmann::ordered_json age_s = nullptr;
  if (timecode.last_frame_at) age_s = to_s(health.at - *timecode.last_frame_at);
  return {{"source", timecode.source == TimecodeSourceKind::Utc ? "utc" : "ltc"},
          {"state", word_of(timecode.state)},
          {"locked", timecode.state == TimecodeState::Locked},
          {"age_s", age_s},
          {"now", now ? nlohmann::ordered_json(text_of(*now)) : nullptr},
          {"drift_ppm", timecode.drift_ppm},
          {"frames", timecode.frames},
          {"rejected_frames", timecode.rejected_frames},
          {"jumps", timecode.jumps},
          {"sentence", text_of(timecode.sentence)}};
}

nlohmann::ordered_json recording_object(const RecordingHealth& recording) {
  return {{"path", recording.path},
          {"state", word_of(recording.state)},
          {"size_bytes", recording.size_bytes},
          {"records", recording.records},
          {"error", recording.error}};
}

}  // namespace

std::string summary_json(const FeedState& feed, const std::string& endpoint, Duration watched) {
  const auto share = [](std::uint64_t part, std::uint64_t whole) -> nlohmann::ordered_json {
    if (whole == 0) return nullptr;
    return static_cast<double>(part) / static_cast<double>(whole);
  };
  const auto age_ms = [&](double p) -> nlohmann::ordered_json {
    const auto age = feed.age(p);
    if (!age) return nullptr;
    return ms(*age);
  };
  nlohmann::ordered_json object = {{"endpoint", endpoint},
                                   {"seconds", to_s(watched)},
                                   {"frames", feed.frames()},
                                   {"complete_share", share(feed.complete(), feed.frames())},
                                   {"tracking_share", share(feed.tracking(), feed.frames())},
                                   {"labelled_share", share(feed.labelled(), feed.labels_expected())},
                                   {"lost", feed.lost()},
                                   {"passed_over", feed.passed_over()},
                                   {"restarts", feed.restarts()},
                                   {"unreadable", feed.unreadable()},
                                   {"age_p50_ms", age_ms(0.5)},
                                   {"age_p99_ms", age_ms(0.99)}};
  if (feed.description()) object["producer"] = feed.description()->producer;
  if (feed.health()) {
    object["latency"] = latency_object(*feed.health());
    object["drops"] = drops_of(*feed.health());
    object["feed"] = feed_object(feed.health()->feed);
    if (feed.health()->timecode.source != TimecodeSourceKind::None)
      object["timecode"] = timecode_object(*feed.health());
    for (const CameraHealth& camera : feed.health()->cameras) object["cameras"][camera.name] = camera_object(camera);
    for (const RecordingHealth& recording : feed.health()->recordings) {
      object["recordings"].push_back(recording_object(recording));
    }
    for (const SearchHealth& search : feed.health()->searches) {
      object["missing_subjects"].push_back(std::string(text_of(search.sentence)));
    }
  }
  return object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace mocap::watch
