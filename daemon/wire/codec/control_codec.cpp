#include "wire/codec/control_codec.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/file_name.h"
#include "wire/codec/calibration_codec.h"
#include "wire/codec/encode.h"
#include "wire/codec/encode_numbers.h"
#include "wire/codec/mask_codec.h"
#include "wire/codec/utf8.h"

namespace mocap::wire {
namespace {

constexpr double kMostExposure_us = 1e6;  // same limits as [[cameras]] exposure_us and gain_db
constexpr double kMostGain_dB = 60.0;
constexpr double kFarthestOffset_m = 10.0;  // far larger than any body
constexpr double kLongestSpan_s = 7 * 86400.0;
constexpr std::size_t kLongestName = 255, kLongestPath = 4095, kLongestAsker = 64, kLongestText = 48 * 1024;

Error wrong_control(std::string what) { return {ErrorCode::InvalidArgument, std::move(what)}; }

Result<std::vector<Eigen::Vector3d>> vectors(const google::protobuf::RepeatedField<double>& column, std::size_t most,
                                             const char* name) {
  if (column.size() % 3 != 0 || static_cast<std::size_t>(column.size()) > 3 * most) {
    return wrong_control(fmt::format("{} has {} numbers, expected 3 each for at most {}", name, column.size(), most));
  }
  std::vector<Eigen::Vector3d> all;
  for (int i = 0; i < column.size(); i += 3) {
    const Eigen::Vector3d v(column[i], column[i + 1], column[i + 2]);
    if (!v.allFinite() || v.cwiseAbs().maxCoeff() > kFarthestOffset_m) {
      return wrong_control(fmt::format("{}: entry {} is too large or not finite, expected at most {} m", name, i / 3,
                                       kFarthestOffset_m));
    }
    all.push_back(v);
  }
  return all;
}

bool can_be_quoted(const std::string& text) {
  return std::ranges::none_of(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '"' || c == '\\'; });
}

// The daemon writes name and marker_set of a new subject as quoted strings into the configuration file.
Status check_new_subject(const v1::SubjectRequest& from) {
  const std::string& path = from.marker_set();
  if (path.front() != '/' || path.size() > kLongestPath || !can_be_quoted(path)) {
    return wrong_control(
        "marker_set is not an absolute path on the daemon's machine, or has quotes or control characters");
  }
  if (from.name().empty() || !can_be_quoted(from.name())) {
    return wrong_control("name is empty, or has quotes or control characters");
  }
  return {};
}

// The daemon writes the text into a file of this name.
Status check_new_text(const v1::SubjectRequest& from) {
  if (!from.marker_set().empty()) {
    return wrong_control("marker_set and marker_set_text are both set, expected one of them");
  }
  if (from.marker_set_text().size() > kLongestText) {
    return wrong_control(fmt::format("marker_set_text has {} bytes, at most {} are allowed",
                                     from.marker_set_text().size(), kLongestText));
  }
  if (!is_file_name(from.name())) {
    return wrong_control(
        fmt::format("name is '{}', expected at most 64 letters, digits, '_', '-', '.' or spaces, the "
                    "first a letter, a digit or '_'",
                    from.name()));
  }
  return {};
}

Result<ControlRequest> decode_subject_request(const v1::SubjectRequest& from) {
  ControlRequest into;
  into.name = from.name();
  switch (from.action()) {
    case v1::SubjectRequest::ACTION_ADD: into.action = ControlAction::AddSubject; break;
    case v1::SubjectRequest::ACTION_REMOVE: into.action = ControlAction::RemoveSubject; break;
    case v1::SubjectRequest::ACTION_RESET: into.action = ControlAction::ResetSubject; break;
    case v1::SubjectRequest::ACTION_FIT: into.action = ControlAction::FitSubject; break;
    default: return wrong_control("subject: action is missing, expected add, remove, reset or fit");
  }
  if (into.action == ControlAction::AddSubject && !from.marker_set().empty()) {
    if (Status new_one = check_new_subject(from); !new_one) return new_one.error();
    into.marker_set = from.marker_set();
  }
  if (into.action == ControlAction::AddSubject && !from.marker_set_text().empty()) {
    if (Status new_one = check_new_text(from); !new_one) return new_one.error();
    into.marker_set_text = from.marker_set_text();
  }
  if (into.action != ControlAction::FitSubject) return into;
  auto bones = vectors(from.rest_offsets_m(), kMaxBones, "rest_offsets_m");
  if (!bones) return bones.error();
  auto markers = vectors(from.marker_offsets_m(), kMaxLabels, "marker_offsets_m");
  if (!markers) return markers.error();
  if (!std::isfinite(from.residual_m()) || from.residual_m() < 0.0)
    return wrong_control("residual_m is negative or not finite");
  into.rest_offsets_m = *std::move(bones);
  into.marker_offsets_m = *std::move(markers);
  into.residual_m = from.residual_m();
  return into;
}

Result<ControlRequest> decode_camera_request(const v1::CameraRequest& from) {
  ControlRequest into;
  into.action = ControlAction::AdjustCamera;
  into.name = from.name();
  if (from.has_exposure_us()) into.exposure_us = from.exposure_us();
  if (from.has_gain_db()) into.gain_db = from.gain_db();
  if (!into.exposure_us && !into.gain_db)
    return wrong_control("camera: nothing to set, expected exposure_us or gain_db");
  // The comparisons are written so that NaN is rejected.
  if (into.exposure_us && !(*into.exposure_us >= 1.0 && *into.exposure_us <= kMostExposure_us)) {
    return wrong_control(fmt::format("exposure_us is {}, expected 1 to {}", *into.exposure_us, kMostExposure_us));
  }
  if (into.gain_db && !(*into.gain_db >= 0.0 && *into.gain_db <= kMostGain_dB)) {
    return wrong_control(fmt::format("gain_db is {}, expected 0 to {}", *into.gain_db, kMostGain_dB));
  }
  return into;
}

Result<ControlRequest> plain(ControlAction action) {
  ControlRequest into;
  into.action = action;
  return into;
}

Result<ControlRequest> decode_capture(const v1::CaptureRequest& from) {
  switch (from.action()) {
    case v1::CaptureRequest::ACTION_START: return plain(ControlAction::StartCapture);
    case v1::CaptureRequest::ACTION_STOP: return plain(ControlAction::StopCapture);
    default: return wrong_control("capture: action is missing, expected start or stop");
  }
}

// Texts are checked by the recorder, which knows what a file may be called.
Result<ControlRequest> decode_take(const v1::TakeRequest& from) {
  ControlRequest into;
  into.action = ControlAction::Take;
  TakeOrder& take = into.take;
  switch (from.action()) {
    case v1::TakeRequest::ACTION_START: take.action = TakeAction::Start; break;
    case v1::TakeRequest::ACTION_STOP: take.action = TakeAction::Stop; break;
    case v1::TakeRequest::ACTION_CANCEL: take.action = TakeAction::Cancel; break;
    case v1::TakeRequest::ACTION_MARK: take.action = TakeAction::Mark; break;
    case v1::TakeRequest::ACTION_NEXT: take.action = TakeAction::Next; break;
    default: return wrong_control("take: action is missing, expected start, stop, cancel, mark or next");
  }
  const struct {
    const char* name;
    double value;
  } spans[] = {{"before_s", from.before_s()}, {"seconds", from.seconds()}, {"countdown_s", from.countdown_s()}};
  for (const auto& [name, value] : spans) {
    if (value >= 0.0 && value <= kLongestSpan_s) continue;
    return wrong_control(fmt::format("{} is {}, expected 0 to {}", name, value, kLongestSpan_s));
  }
  if (from.at_utc_ns() < 0)
    return wrong_control(fmt::format("at_utc_ns is {}, expected a time after 1970", from.at_utc_ns()));
  if (from.text().size() > kLongestPath) return wrong_control(fmt::format("text has over {} bytes", kLongestPath));
  take.name = from.name();
  take.slate = from.slate();
  take.text = from.text();
  take.before = from_s(from.before_s());
  take.length = from_s(from.seconds());
  take.countdown = from_s(from.countdown_s());
  take.at_utc_ns = from.at_utc_ns();
  if (!from.has_at_timecode()) return into;
  const v1::Timecode& at = from.at_timecode();
  if (at.hours() > 23 || at.minutes() > 59 || at.seconds() > 59) {
    return wrong_control(
        fmt::format("at_timecode is {}:{}:{}, expected 0:0:0 to 23:59:59", at.hours(), at.minutes(), at.seconds()));
  }
  if (from.at_utc_ns() != 0) return wrong_control("at_utc_ns and at_timecode are both set, expected one of them");
  take.at_timecode = timecode_of(at);
  return into;
}

Result<ControlRequest> decode_shots(const v1::ShotsRequest& from) {
  ControlRequest into;
  into.action = ControlAction::Take;
  switch (from.action()) {
    case v1::ShotsRequest::ACTION_LIST: into.action = ControlAction::GetShots; return into;
    case v1::ShotsRequest::ACTION_CLEAR: into.take.action = TakeAction::ClearShots; return into;
    case v1::ShotsRequest::ACTION_IMPORT: into.take.action = TakeAction::ImportShots; break;
    default: return wrong_control("shots: action is missing, expected list, import or clear");
  }
  if (from.shots().empty() || static_cast<std::size_t>(from.shots_size()) > kMaxShots) {
    return wrong_control(fmt::format("shots has {} entries, expected 1 to {}", from.shots_size(), kMaxShots));
  }
  for (const v1::Shot& shot : from.shots()) {
    if (!(shot.seconds() >= 0.0 && shot.seconds() <= kLongestSpan_s)) {
      return wrong_control(fmt::format("shots: seconds is {}, expected 0 to {}", shot.seconds(), kLongestSpan_s));
    }
    into.take.shots.push_back({shot.name(), shot.slate(), shot.notes(), from_s(shot.seconds()), shot.done()});
  }
  return into;
}

void encode_shots(const std::vector<Shot>& from, google::protobuf::RepeatedPtrField<v1::Shot>& into) {
  for (const Shot& shot : from) {
    v1::Shot& to = *into.Add();
    to.set_name(valid_utf8(shot.name));
    to.set_slate(valid_utf8(shot.slate));
    to.set_notes(valid_utf8(shot.notes));
    to.set_seconds(to_s(shot.length));
    to.set_done(shot.done);
  }
}

Result<ControlRequest> decode_calibration(const v1::CalibrationRequest& from) {
  Result<CalibrationOrder> order = decode(from);
  if (!order) return order.error();
  ControlRequest into;
  const bool looks = order->action == CalibrationAction::Look || order->action == CalibrationAction::List;
  into.action = looks ? ControlAction::GetCalibration : ControlAction::Calibrate;
  into.calibration = *std::move(order);
  return into;
}

v1::Code answer_code_of(ControlCode code) {
  switch (code) {
    case ControlCode::Done: return v1::CODE_DONE;
    case ControlCode::Invalid: return v1::CODE_INVALID;
    case ControlCode::NotFound: return v1::CODE_NOT_FOUND;
    case ControlCode::Forbidden: return v1::CODE_FORBIDDEN;
    case ControlCode::Unsupported: return v1::CODE_UNSUPPORTED;
    case ControlCode::Timeout: return v1::CODE_TIMEOUT;
    case ControlCode::Failed: return v1::CODE_FAILED;
  }
  return v1::CODE_UNSPECIFIED;
}

void encode_status(const ControlStatus& from, v1::Status& into) {
  into.set_producer(valid_utf8(from.producer));
  into.set_session_id(valid_utf8(from.session_id));
  into.set_capturing(from.capturing);
  if (from.health) encode(*from.health, *into.mutable_health());
  for (const auto& subject : from.subjects) {
    v1::SubjectStatus& to = *into.add_subjects();
    to.set_name(valid_utf8(subject.name));
    to.set_phase(code_of(subject.phase));
    to.set_away(subject.away);
  }
}

void encode_fit(const ControlRequest& from, v1::SubjectRequest& into) {
  for (const auto& v : from.rest_offsets_m) {
    for (const double x : v) into.add_rest_offsets_m(x);
  }
  for (const auto& v : from.marker_offsets_m) {
    for (const double x : v) into.add_marker_offsets_m(x);
  }
  into.set_residual_m(from.residual_m);
}

v1::SubjectRequest encode_subject(const ControlRequest& from) {
  v1::SubjectRequest into;
  into.set_name(valid_utf8(from.name));
  into.set_marker_set(valid_utf8(from.marker_set));
  into.set_marker_set_text(valid_utf8(from.marker_set_text));
  switch (from.action) {
    case ControlAction::AddSubject: into.set_action(v1::SubjectRequest::ACTION_ADD); break;
    case ControlAction::RemoveSubject: into.set_action(v1::SubjectRequest::ACTION_REMOVE); break;
    case ControlAction::ResetSubject: into.set_action(v1::SubjectRequest::ACTION_RESET); break;
    default: into.set_action(v1::SubjectRequest::ACTION_FIT); encode_fit(from, into);
  }
  return into;
}

bool is_about_shots(TakeAction action) {
  return action == TakeAction::ListShots || action == TakeAction::ImportShots || action == TakeAction::ClearShots;
}

v1::ShotsRequest encode_shots_request(const TakeOrder& from) {
  v1::ShotsRequest into;
  switch (from.action) {
    case TakeAction::ImportShots: into.set_action(v1::ShotsRequest::ACTION_IMPORT); break;
    case TakeAction::ClearShots: into.set_action(v1::ShotsRequest::ACTION_CLEAR); break;
    default: into.set_action(v1::ShotsRequest::ACTION_LIST);
  }
  encode_shots(from.shots, *into.mutable_shots());
  return into;
}

v1::TakeRequest encode_take(const TakeOrder& from) {
  v1::TakeRequest into;
  switch (from.action) {
    case TakeAction::Start: into.set_action(v1::TakeRequest::ACTION_START); break;
    case TakeAction::Stop: into.set_action(v1::TakeRequest::ACTION_STOP); break;
    case TakeAction::Cancel: into.set_action(v1::TakeRequest::ACTION_CANCEL); break;
    case TakeAction::Mark: into.set_action(v1::TakeRequest::ACTION_MARK); break;
    case TakeAction::Next: into.set_action(v1::TakeRequest::ACTION_NEXT); break;
    default: break;  // the orders about shots are another request
  }
  into.set_name(valid_utf8(from.name));
  into.set_slate(valid_utf8(from.slate));
  into.set_text(valid_utf8(from.text));
  into.set_before_s(to_s(from.before));
  into.set_seconds(to_s(from.length));
  into.set_countdown_s(to_s(from.countdown));
  into.set_at_utc_ns(from.at_utc_ns);
  if (from.at_timecode) encode(*from.at_timecode, *into.mutable_at_timecode());
  return into;
}

Result<ControlRequest> decode_order(const v1::Request& from) {
  Result<ControlRequest> read = wrong_control("the request is empty, or of a later version than this daemon");
  switch (from.what_case()) {
    case v1::Request::kStatus: return plain(ControlAction::GetStatus);
    case v1::Request::kDescription: return plain(ControlAction::GetDescription);
    case v1::Request::kSnapshot: return plain(ControlAction::GetSnapshot);
    case v1::Request::kReload: return plain(ControlAction::Reload);
    case v1::Request::kCapture: return decode_capture(from.capture());
    case v1::Request::kSubject: read = decode_subject_request(from.subject()); break;
    case v1::Request::kCamera: read = decode_camera_request(from.camera()); break;
    case v1::Request::kMask: read = decode(from.mask()); break;
    case v1::Request::kTake: read = decode_take(from.take()); break;
    case v1::Request::kShots: read = decode_shots(from.shots()); break;
    case v1::Request::kCalibration: return decode_calibration(from.calibration());
    case v1::Request::WHAT_NOT_SET: break;
  }
  if (read && read->name.size() > kLongestName) {
    return wrong_control(fmt::format("name has {} bytes, at most {} are allowed", read->name.size(), kLongestName));
  }
  return read;
}

}  // namespace

Result<ControlRequest> decode(const v1::Request& from) {
  if (from.asked_by().size() > kLongestAsker) {
    return wrong_control(
        fmt::format("asked_by has {} bytes, at most {} are allowed", from.asked_by().size(), kLongestAsker));
  }
  Result<ControlRequest> read = decode_order(from);
  if (read) read->by.states = from.asked_by();
  return read;
}

v1::Request encode(const ControlRequest& from) {
  v1::Request into;
  into.set_asked_by(from.by.states);
  switch (from.action) {
    case ControlAction::GetStatus: into.mutable_status(); break;
    case ControlAction::GetDescription: into.mutable_description(); break;
    case ControlAction::GetSnapshot: into.mutable_snapshot(); break;
    case ControlAction::Reload: into.mutable_reload(); break;
    case ControlAction::GetCalibration:
    case ControlAction::Calibrate: *into.mutable_calibration() = encode(from.calibration); break;
    case ControlAction::GetShots: into.mutable_shots()->set_action(v1::ShotsRequest::ACTION_LIST); break;
    case ControlAction::Take:
      if (is_about_shots(from.take.action)) {
        *into.mutable_shots() = encode_shots_request(from.take);
      } else {
        *into.mutable_take() = encode_take(from.take);
      }
      break;
    case ControlAction::StartCapture: into.mutable_capture()->set_action(v1::CaptureRequest::ACTION_START); break;
    case ControlAction::StopCapture: into.mutable_capture()->set_action(v1::CaptureRequest::ACTION_STOP); break;
    case ControlAction::AddSubject:
    case ControlAction::RemoveSubject:
    case ControlAction::ResetSubject:
    case ControlAction::FitSubject: *into.mutable_subject() = encode_subject(from); break;
    case ControlAction::AdjustCamera:
      into.mutable_camera()->set_name(valid_utf8(from.name));
      if (from.exposure_us) into.mutable_camera()->set_exposure_us(*from.exposure_us);
      if (from.gain_db) into.mutable_camera()->set_gain_db(*from.gain_db);
      break;
    case ControlAction::LearnMask:
    case ControlAction::DrawMasks:
    case ControlAction::UndoMasks:
    case ControlAction::ForgetMasks:
    case ControlAction::GetMasks: *into.mutable_mask() = encode_mask_request(from); break;
  }
  return into;
}

v1::Answer encode(const ControlAnswer& from) {
  v1::Answer into;
  into.set_code(answer_code_of(from.code));
  into.set_message(valid_utf8(from.message));
  if (from.status) encode_status(*from.status, *into.mutable_status());
  if (from.description != nullptr) *into.mutable_description() = encode(*from.description);
  if (from.snapshot != nullptr) encode(*from.snapshot, *into.mutable_snapshot());
  if (from.shots) encode_shots(*from.shots, *into.mutable_shots()->mutable_shots());
  if (from.calibration != nullptr) *into.mutable_calibration() = encode(*from.calibration);
  if (from.rigs) *into.mutable_rigs() = encode(*from.rigs);
  if (from.masks) *into.mutable_masks() = encode(*from.masks);
  return into;
}

}  // namespace mocap::wire
