#include "lib/preflight/preflight.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/blob_use.h"

namespace mocap::preflight {
namespace {

constexpr double kRateShare = 0.95;      // of the nominal rate; a camera's own rate is exact to 1 %
constexpr double kCompleteShare = 0.99;  // of the sets
constexpr double kPeriodsLate = 3.0;     // p99 of the total latency in periods: a live receiver sees later frames jump
constexpr double kBrightBackground =
    60.0;  // grey value of 255: markers, at most 255, then stand out by less than 3 : 1
constexpr double kOldRig_days = 30.0;
constexpr double kFewMinutes = 30.0;
constexpr double kTooFewMinutes = 5.0;

const v1::CameraHealth* camera_before(const v1::Status& before, const std::string& name) {
  const auto& all = before.health().cameras();
  const auto found = std::ranges::find_if(all, [&](const v1::CameraHealth& each) { return each.name() == name; });
  return found == all.end() ? nullptr : &*found;
}

// The rate at which the camera is to deliver; 0: unknown. Without the rate of any camera, all are to deliver at the
// rate of the description: the daemon is older, or only [capture] has a rate.
double nominal_rate_hz(const PreflightFacts& facts, const std::string& name) {
  const auto& all = facts.description.cameras();
  if (std::ranges::none_of(all, [](const v1::Camera& each) { return each.nominal_rate_hz() > 0.0; }))
    return facts.description.nominal_rate_hz();
  const auto found = std::ranges::find_if(all, [&](const v1::Camera& each) { return each.name() == name; });
  return found == all.end() ? 0.0 : found->nominal_rate_hz();
}

// The images that the camera lost since `before`, by reason.
std::string losses(const v1::CameraHealth& now, const v1::CameraHealth& before) {
  const auto lost = now.missing_frames() - before.missing_frames() + now.failed_frames() - before.failed_frames();
  const auto dropped = now.dropped_queue_full() - before.dropped_queue_full();
  if (lost == 0 && dropped == 0) return {};
  return fmt::format("lost {} images on the way and {} in the daemon within the check", lost, dropped);
}

// The first fault of a camera, the most severe first.
Finding examine_camera(const PreflightFacts& facts, int index) {
  const v1::CameraHealth& camera = facts.now.health().cameras(index);
  const std::string check = "camera " + camera.name();
  if (camera.phase() != v1::CAMERA_PHASE_STREAMING) {
    return bad(check, camera.last_error().empty() ? "delivers no images" : camera.last_error(),
               "check power and cable; mocapctl cameras list");
  }
  if (camera.bumped()) {
    return bad(check, fmt::format("deviates from the rig by {:.1f} px", camera.rig_off_px()), "mocap-calibrate refine");
  }
  if (camera.clock_source() == v1::CLOCK_SOURCE_LOST) {
    return bad(check, "its clock lost PTP", "check the PTP master and the switches between; mocapctl cameras describe");
  }
  if (camera.has_synchronised() && !camera.synchronised()) {
    return bad(check, fmt::format("exposes {:.0f} us off the other cameras", camera.offset_us()),
               "trigger all cameras by one signal, or synchronise them with one PTP clock");
  }
  const double nominal_hz = nominal_rate_hz(facts, camera.name());
  if (nominal_hz > 0.0 && camera.rate_hz() < kRateShare * nominal_hz) {
    return bad(check, fmt::format("delivers {:.1f} images a second of {:.1f}", camera.rate_hz(), nominal_hz),
               "exposure below the period? mocapctl doctor checks network and machine");
  }
  if (const auto* before = camera_before(facts.before, camera.name()); before != nullptr) {
    if (const std::string lost = losses(camera, *before); !lost.empty()) return bad(check, lost, "mocapctl doctor");
  }
  if (camera.background_grey() > kBrightBackground) {
    return warning(
        check, fmt::format("its images are bright: background {:.0f} of 255", camera.background_grey()),
        fmt::format("mocapctl camera set {} --exposure-us N with a shorter exposure, or less light", camera.name()));
  }
  std::vector<BlobUse> use;
  for (const v1::CameraHealth& each : facts.now.health().cameras())
    use.push_back({each.fused_blobs(), each.marker_blobs()});
  if (const std::string why = why_no_markers(use, static_cast<std::size_t>(index)); !why.empty()) {
    return warning(check, why, kNoMarkersRemedy);
  }
  return good(check, fmt::format("{:.1f} images a second", camera.rate_hz()));
}

Finding examine_sets(const PreflightFacts& facts) {
  const v1::Health &now = facts.now.health(), &before = facts.before.health();
  const std::uint64_t sets = now.sets() - before.sets();
  if (sets == 0) return bad("sets", "no image set within the check", "mocapctl status");
  const auto skipped = now.passed_over_sets() - before.passed_over_sets();
  if (skipped > 0)
    return bad("sets", fmt::format("{} sets skipped within the check: the machine is too slow", skipped),
               "mocapctl doctor");
  const double complete = static_cast<double>(now.complete_sets() - before.complete_sets()) / static_cast<double>(sets);
  if (complete < kCompleteShare) {
    return warning("sets", fmt::format("{:.1f} % have an image of every camera", 100.0 * complete),
                   "mocapctl status names the camera");
  }
  return good("sets", fmt::format("{:.1f} a second, {:.1f} % complete", now.set_rate_hz(), 100.0 * complete));
}

std::optional<Finding> examine_latency(const PreflightFacts& facts) {
  const double rate_hz = facts.description.nominal_rate_hz();
  for (const v1::StageLatency& stage : facts.now.health().latencies()) {
    if (stage.stage() != v1::LATENCY_STAGE_TOTAL || rate_hz <= 0.0) continue;
    const double p99_s = 1e-9 * static_cast<double>(stage.p99_ns());
    if (p99_s > kPeriodsLate / rate_hz) {
      return warning("latency", fmt::format("1 of 100 snapshots is later than {:.1f} ms", 1e3 * p99_s),
                     "mocap-watch shows the slow stage; section [realtime] of the configuration");
    }
    return good("latency", fmt::format("99 of 100 snapshots within {:.1f} ms", 1e3 * p99_s));
  }
  return std::nullopt;
}

Finding examine_subject(const PreflightFacts& facts, int index) {
  const v1::SubjectStatus& subject = facts.now.subjects(index);
  const std::string check = "subject " + subject.name();
  if (subject.away()) return good(check, "is away");
  if (subject.phase() == v1::SUBJECT_PHASE_TRACKING) return good(check, "is tracked");
  for (const v1::SearchHealth& search : facts.now.health().searches()) {
    if (static_cast<int>(search.subject()) == index) return warning(check, search.sentence(), "mocap-watch --doctor");
  }
  return warning(check, "is searched for",
                 fmt::format("a T-pose in the volume; or mocapctl subject remove {}", subject.name()));
}

Finding examine_feed(const v1::FeedHealth& feed) {
  if (feed.behind() > 0) {
    return warning("subscribers",
                   fmt::format("{} of {} are too slow and lose messages", feed.behind(), feed.listeners()),
                   "their own program or network is too slow");
  }
  return good("subscribers", fmt::format("{}", feed.listeners()));
}

void examine_files(const v1::Health& health, std::vector<Finding>& findings) {
  for (const v1::RecordingHealth& each : health.recordings()) {
    if (each.state() == v1::RECORDING_STATE_FAILED)
      findings.push_back(bad("recording " + each.path(), each.error(), "free the disk; mocapctl reload"));
  }
  if (!health.has_take()) return;
  if (health.take().state() == v1::TAKE_STATE_FAILED) {
    findings.push_back(warning("last take", health.take().message(), "mocapctl take show " + health.take().path()));
  } else if (health.take().state() == v1::TAKE_STATE_RECORDING) {
    findings.push_back(warning("take", health.take().name() + " is being recorded", "mocapctl take stop"));
  }
}

void examine_disk_and_rig(const PreflightFacts& facts, std::vector<Finding>& findings) {
  if (const auto minutes = facts.free_minutes) {
    const std::string what = fmt::format("room for {:.0f} minutes of takes", *minutes);
    const std::string cure = "delete or move old takes";
    findings.push_back(*minutes < kTooFewMinutes ? bad("disk", what, cure)
                       : *minutes < kFewMinutes  ? warning("disk", what, cure)
                                                 : good("disk", what));
    findings.back().minutes = *minutes;
  }
  if (const auto days = facts.calibration_age_days) {
    const std::string what = fmt::format("the rig file is {:.0f} days old", *days);
    findings.push_back(*days > kOldRig_days
                           ? warning("calibration", what, "mocap-calibrate verify, then refine or wand")
                           : good("calibration", what));
  }
}

}  // namespace

std::vector<Finding> examine_daemon(const PreflightFacts& facts) {
  std::vector<Finding> findings;
  if (!facts.now.capturing()) {
    findings.push_back(bad("capture", "the cameras are stopped", "mocapctl capture start"));
    return findings;
  }
  if (!facts.now.has_health()) {
    findings.push_back(bad("daemon", "sent no report yet", "wait a second"));
    return findings;
  }
  for (int i = 0; i < facts.now.health().cameras_size(); ++i) findings.push_back(examine_camera(facts, i));
  findings.push_back(examine_sets(facts));
  if (auto latency = examine_latency(facts)) findings.push_back(*std::move(latency));
  for (int i = 0; i < facts.now.subjects_size(); ++i) findings.push_back(examine_subject(facts, i));
  findings.push_back(examine_feed(facts.now.health().feed()));
  examine_files(facts.now.health(), findings);
  examine_disk_and_rig(facts, findings);
  return findings;
}

}  // namespace mocap::preflight
