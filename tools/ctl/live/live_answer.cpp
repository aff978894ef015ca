#include "ctl/live/live_answer.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cctype>
#include <numbers>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/blob_use.h"
#include "take/recorder/shot_list.h"
#include "wire/codec/encode_numbers.h"

namespace mocap::ctl {
namespace {

const char* word_of(v1::SubjectPhase phase, bool away) {
  if (away) return "away";
  switch (phase) {
    case v1::SUBJECT_PHASE_TRACKING: return "tracking";
    case v1::SUBJECT_PHASE_LOST: return "lost";
    default: return "searching";
  }
}

// Converts CAMERA_PHASE_STREAMING to "streaming", with the prefix "CAMERA_PHASE_".
std::string word_of(const std::string& name, const std::string& prefix) {
  std::string word = name.substr(std::min(name.size(), prefix.size()));
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

std::string word_of(v1::CameraPhase phase) { return word_of(v1::CameraPhase_Name(phase), "CAMERA_PHASE_"); }

std::string word_of(v1::RecordingState state) { return word_of(v1::RecordingState_Name(state), "RECORDING_STATE_"); }

// The share of the camera's blobs in 3D markers over the last second, and why it is too small.
std::string marker_share_of(const v1::Health& health, int index) {
  const v1::CameraHealth& camera = health.cameras(index);
  if (!camera.has_marker_share()) return "in 3D -";
  std::vector<BlobUse> use;
  for (const v1::CameraHealth& each : health.cameras()) use.push_back({each.fused_blobs(), each.marker_blobs()});
  const std::string why = why_no_markers(use, static_cast<std::size_t>(index));
  return fmt::format("in 3D {:.0f} %{}", 100.0 * camera.marker_share(),
                     why.empty() ? why : fmt::format("  {} since the start; {}", why, kNoMarkersRemedy));
}

void print_camera(const v1::Health& health, int index) {
  const v1::CameraHealth& camera = health.cameras(index);
  fmt::print("camera  {:20} {:10} {:6.1f} Hz  frames {}  missing {}  {}  {}{}\n", camera.name(),
             word_of(camera.phase()), camera.rate_hz(), camera.frames(), camera.missing_frames(),
             marker_share_of(health, index), camera.last_error(),
             camera.bumped() ? fmt::format("deviates from the rig by {:.1f} px", camera.rig_off_px()) : std::string());
}

// The reason why a subject is not found; empty if the daemon has none.
std::string reason_of(const v1::Status& status, int subject) {
  for (const v1::SearchHealth& search : status.health().searches()) {
    if (static_cast<int>(search.subject()) == subject) return search.sentence();
  }
  return {};
}

void print_take(const v1::TakeHealth& take) {
  fmt::print("take    {:20} {:10} {:.2f} s  {:.1f} MB  lost sets {}  lost images {}  {}{}{}  {}\n",
             take.path().empty() ? take.name() : take.path(), word_of(v1::TakeState_Name(take.state()), "TAKE_STATE_"),
             take.seconds(), 1e-6 * static_cast<double>(take.size_bytes()), take.lost_sets(), take.lost_images(),
             word_of(v1::TakeQuality_Name(take.quality()), "TAKE_QUALITY_"), take.reasons().empty() ? "" : ": ",
             take.reasons(), take.message());
}

// "timecode 10:00:00:00 (LTC, locked, last frame 0.1 s ago, 12 ppm fast)", and why there is none.
void print_timecode(const v1::TimecodeHealth& health) {
  const Timecode now = wire::timecode_of(health.now());
  const bool is_ltc = health.source() == v1::TIMECODE_SOURCE_LTC;
  std::string line =
      fmt::format("timecode {:19} {:10} {}", health.has_now() ? text_of(now) : "none",
                  word_of(v1::TimecodeState_Name(health.state()), "TIMECODE_STATE_"), is_ltc ? "LTC" : "UTC");
  if (health.has_now()) line += fmt::format("  {:.6g} frames/s", rate_hz(now));
  if (health.has_age_s()) {
    line += fmt::format("  last frame {:.1f} s ago  drift {:.0f} ppm  rejected {}  jumps {}", health.age_s(),
                        health.drift_ppm(), health.rejected_frames(), health.jumps());
  }
  fmt::print("{}\n", line);
  if (!health.sentence().empty()) fmt::print("        {}\n", health.sentence());
}

void print_status(const v1::Status& status) {
  fmt::print("{}  session {}  capture {}  you are {}\n", status.producer(), status.session_id(),
             status.capturing() ? "runs" : "is stopped", status.role());
  for (int i = 0; i < status.subjects_size(); ++i) {
    const v1::SubjectStatus& subject = status.subjects(i);
    fmt::print("subject {:20} {}\n", subject.name(), word_of(subject.phase(), subject.away()));
    if (const std::string reason = reason_of(status, i); !reason.empty()) fmt::print("        {}\n", reason);
  }
  if (!status.has_health()) return fmt::print("no report yet\n");
  const v1::Health& health = status.health();
  for (int i = 0; i < health.cameras_size(); ++i) print_camera(health, i);
  fmt::print("sets    {:.1f}/s, complete {} of {}\n", health.set_rate_hz(), health.complete_sets(), health.sets());
  const v1::FeedHealth& feed = health.feed();
  fmt::print("feed    listeners {}  behind {}  refused {}  failed handshakes {}  cut off {}  sent {}\n",
             feed.listeners(), feed.behind(), feed.refused_clients(), feed.failed_handshakes(), feed.cut_off(),
             health.sent_snapshots());
  for (const auto& recording : health.recordings()) {
    fmt::print("record  {:20} {:10} {:.1f} MB  records {}  {}\n", recording.path(), word_of(recording.state()),
               1e-6 * static_cast<double>(recording.size_bytes()), recording.records(), recording.error());
  }
  if (health.has_take()) print_take(health.take());
  if (health.has_timecode()) print_timecode(health.timecode());
}

// A figure of a calibration in `unit`; 0 is unknown.
std::string figure_text(double figure, double unit, int digits) {
  return figure > 0.0 ? fmt::format("{:.{}f}", unit * figure, digits) : "-";
}

void print_calibration_result(const v1::Calibration& calibration) {
  const v1::CalibrationResult& result = calibration.result();
  if (calibration.floor()) {
    fmt::print("floor   residual {}\n",
               result.has_floor_rms_m() ? fmt::format("{:.1f} mm", 1e3 * result.floor_rms_m()) : "-");
    for (const std::string& issue : result.issues()) fmt::print("        {}\n", issue);
    return;
  }
  fmt::print("{:20} {:>7} {:>8} {:>7} {:>8} {:>9} {:>10}\n", "camera", "rms px", "held out", "points", "coverage",
             "sigma mm", "sigma deg");
  for (const v1::CalibrationCamera& camera : calibration.cameras()) {
    fmt::print("{:20} {:7.3f} {:>8} {:7} {:6.0f} % {:>9} {:>10}\n", camera.name(), camera.rms_px(),
               figure_text(camera.heldout_px(), 1.0, 3), camera.points(), 100.0 * camera.coverage(),
               figure_text(camera.position_sigma_m(), 1e3, 2),
               figure_text(camera.rotation_sigma_rad(), 180.0 / std::numbers::pi, 4));
  }
  fmt::print("{:20} {:7.3f} {:>8}\n", "all", result.rms_px(), figure_text(result.heldout_px(), 1.0, 3));
  fmt::print("grade   {}; {} samples; wand {} mm +- {}\n", result.grade(), result.samples(),
             figure_text(result.wand_m(), 1e3, 3), figure_text(result.wand_std_m(), 1e3, 3));
  fmt::print("scale   from the wand's length, not checked\n");
  fmt::print("floor   {}\n",
             result.floor_is_guessed() ? "provisional; measure it with mocapctl calibrate floor" : "where it was");
  for (const std::string& issue : result.issues()) fmt::print("        {}\n", issue);
}

void print_calibration(const v1::Calibration& calibration) {
  fmt::print("calibration {}  {}{}\n", word_of(v1::CalibrationState_Name(calibration.state()), "CALIBRATION_STATE_"),
             calibration.message(),
             calibration.state() == v1::CALIBRATION_STATE_COLLECTING ? calibration.advice() : "");
  if (calibration.has_result()) return print_calibration_result(calibration);
  for (const v1::CalibrationCamera& camera : calibration.cameras()) {
    fmt::print("camera  {:20} images {}  wand {}  shared {} of {}  covered {:.0f} %  dropped {}\n", camera.name(),
               camera.images(), camera.samples(), camera.shared(), calibration.min_shared(), 100.0 * camera.coverage(),
               camera.dropped());
  }
}

void print_rigs(const v1::RigList& list) {
  if (list.rigs().empty()) fmt::print("no rig is kept yet\n");
  for (const v1::KeptRig& rig : list.rigs()) {
    fmt::print("{:24} {:9} {:2} cameras  {:.3f} px  {}\n", rig.name(), rig.in_force() ? "in force" : "", rig.cameras(),
               rig.rms_px(), rig.solved_by());
  }
}

void print_polygons(const char* kind, const google::protobuf::RepeatedPtrField<v1::MaskPolygon>& polygons) {
  for (int i = 0; i < polygons.size(); ++i) {
    std::string corners;
    for (int k = 0; k < polygons[i].x_px_size(); ++k)
      corners += fmt::format("{}{:g},{:g}", k > 0 ? "  " : "", polygons[i].x_px(k), polygons[i].y_px(k));
    fmt::print("        {:6} {:2}  {}\n", kind, i + 1, corners);
  }
}

void print_masks(const v1::MaskList& list) {
  for (const v1::CameraMasks& camera : list.cameras()) {
    fmt::print("camera  {:20} {} drawn, {} learnt, {} steps to undo\n", camera.camera(), camera.drawn_size(),
               camera.learnt_size(), camera.undo_steps());
    print_polygons("drawn", camera.drawn());
    print_polygons("learnt", camera.learnt());
  }
}

void print_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  if (google::protobuf::util::MessageToJsonString(message, &text, options).ok()) fmt::print("{}\n", text);
}

void print_shots(const v1::Answer& answer, bool csv) {
  if (!csv) fmt::print("{}\n", answer.message());
  std::vector<Shot> shots;
  for (const v1::Shot& shot : answer.shots().shots()) {
    shots.push_back({shot.name(), shot.slate(), shot.notes(), from_s(shot.seconds()), shot.done()});
  }
  if (csv) return fmt::print("{}", take::shots_csv(shots));
  for (const Shot& shot : shots) {
    fmt::print("{:4} {:24} {:16} {} {}\n", shot.done ? "done" : "", shot.name, shot.slate,
               shot.length > Duration::zero() ? fmt::format("{:g} s", to_s(shot.length)) : "", shot.notes);
  }
}

}  // namespace

void print_answer(const v1::Answer& answer, bool json, bool csv) {
  if (json) return print_json(answer);
  if (answer.has_shots()) return print_shots(answer, csv);
  if (answer.has_calibration()) return print_calibration(answer.calibration());
  if (answer.has_rigs()) return print_rigs(answer.rigs());
  if (answer.has_masks()) return print_masks(answer.masks());
  if (answer.has_status()) return print_status(answer.status());
  if (answer.has_description()) return print_json(answer.description());
  if (answer.has_snapshot()) return print_json(answer.snapshot());
  if (answer.code() == v1::CODE_DONE) fmt::print("{}\n", answer.message());
}

}  // namespace mocap::ctl
