#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "model/image_bounds.h"
#include "wire/codec/decode.h"
#include "wire/codec/encode.h"
#include "wire/codec/encode_numbers.h"

namespace mocap::wire {
namespace {

constexpr double kLongestAge_s = 1e9;  // fits into a Duration

Error wrong_description(std::string message) {
  return {ErrorCode::InvalidArgument, "description: " + std::move(message)};
}

Eigen::Vector3d vector_of(const v1::Vector3& v) { return {v.x(), v.y(), v.z()}; }

Status check_conventions(const v1::Description& from) {
  if (from.protocol() != kProtocol) {
    return wrong_description(
        fmt::format("protocol is '{}', expected '{}': use a client of that version", from.protocol(), kProtocol));
  }
  const v1::Conventions& c = from.conventions();
  if (c.length_unit() != v1::LENGTH_UNIT_METRE || c.handedness() != v1::HANDEDNESS_RIGHT || c.up_axis() != v1::AXIS_Z ||
      c.quaternion_order() != v1::QUATERNION_ORDER_XYZW || c.clock() != v1::CLOCK_HOST_MONOTONIC) {
    return wrong_description("conventions are not metres, right-handed, z up, x y z w and the host's monotonic clock");
  }
  return {};
}

Result<CameraModel> decode_camera_model(const v1::Camera& from) {
  constexpr std::uint32_t kMaxSide_px = kMaxImageSide_px;
  if (from.width_px() > kMaxSide_px || from.height_px() > kMaxSide_px) {
    return wrong_description(fmt::format("camera '{}' is {} x {} px large, expected at most {} px a side", from.name(),
                                         from.width_px(), from.height_px(), kMaxSide_px));
  }
  CameraModel into;
  into.name = from.name();
  into.width_px = static_cast<int>(from.width_px());
  into.height_px = static_cast<int>(from.height_px());
  into.lens.kind = from.lens_kind() == v1::LENS_KIND_FISHEYE ? LensKind::Fisheye : LensKind::Pinhole;
  into.lens.fx_px = from.fx_px();
  into.lens.fy_px = from.fy_px();
  into.lens.cx_px = from.cx_px();
  into.lens.cy_px = from.cy_px();
  if (from.distortion_size() != 5) {
    return wrong_description(
        fmt::format("camera '{}' has {} distortions, expected 5", from.name(), from.distortion_size()));
  }
  for (int i = 0; i < 5; ++i) into.lens.distortion[i] = from.distortion(i);
  const v1::Quaternion& q = from.camera_from_world_rotation();
  const Eigen::Quaterniond rotation(q.w(), q.x(), q.y(), q.z());
  if (!(std::abs(rotation.norm() - 1.0) < 1e-6)) {
    return wrong_description(fmt::format("camera '{}': rotation is not a unit quaternion", from.name()));
  }
  into.camera_from_world = {rotation.normalized().toRotationMatrix(),
                            vector_of(from.camera_from_world_translation_m())};
  const Lens& lens = into.lens;
  if (!(std::isfinite(lens.fx_px) && std::isfinite(lens.fy_px) && std::isfinite(lens.cx_px) &&
        std::isfinite(lens.cy_px) && lens.distortion.allFinite() && into.camera_from_world.translation.allFinite())) {
    return wrong_description(fmt::format("camera '{}' has a number that is not finite", from.name()));
  }
  return into;
}

std::optional<AngleRange> angle_range_of(bool present, const v1::AngleRange& range) {
  if (!present) return std::nullopt;
  return AngleRange{range.min_rad(), range.max_rad()};
}

Result<Bone> decode_bone(const v1::Bone& from, std::size_t index) {
  if (from.has_parent() && from.parent() >= index) {
    return wrong_description(fmt::format("bone '{}': its parent {} does not precede it", from.name(), from.parent()));
  }
  Bone into;
  into.name = from.name();
  into.parent = from.has_parent() ? static_cast<int>(from.parent()) : -1;
  into.rest_offset_m = vector_of(from.rest_offset_m());
  into.rotation_limits = {angle_range_of(from.has_turn_x(), from.turn_x()),
                          angle_range_of(from.has_turn_y(), from.turn_y()),
                          angle_range_of(from.has_turn_z(), from.turn_z())};
  into.aliases = {from.unity_name(), from.unreal_name(), from.vrm_name()};
  if (!into.rest_offset_m.allFinite())
    return wrong_description(fmt::format("bone '{}': rest_offset_m is not finite", from.name()));
  return into;
}

Result<MarkerOnBone> decode_marker(const v1::Marker& from, std::size_t bones) {
  if (from.bone() >= bones) {
    return wrong_description(
        fmt::format("marker '{}' is on bone {}, expected less than {}", from.name(), from.bone(), bones));
  }
  if (from.colour_rgb_size() != 0 && from.colour_rgb_size() != 3) {
    return wrong_description(
        fmt::format("marker '{}': colour has {} numbers, expected 3", from.name(), from.colour_rgb_size()));
  }
  MarkerOnBone into;
  into.name = from.name();
  into.bone = static_cast<int>(from.bone());
  into.offset_m = vector_of(from.offset_m());
  for (int i = 0; i < from.colour_rgb_size(); ++i) into.colour[static_cast<std::size_t>(i)] = from.colour_rgb(i);
  if (!into.offset_m.allFinite())
    return wrong_description(fmt::format("marker '{}': offset_m is not finite", from.name()));
  return into;
}

Result<Subject> decode_subject_description(const v1::Subject& from) {
  if (static_cast<std::size_t>(from.bones_size()) > kMaxBones ||
      static_cast<std::size_t>(from.markers_size()) > kMaxLabels) {
    return wrong_description(fmt::format("subject '{}' has {} bones and {} markers, at most {} and {} are allowed",
                                         from.name(), from.bones_size(), from.markers_size(), kMaxBones, kMaxLabels));
  }
  Subject into;
  into.name = from.name();
  into.marker_set.name = from.marker_set();
  into.marker_set.skeleton.name = from.skeleton();
  std::vector<Bone>& bones = into.marker_set.skeleton.bones;
  for (const v1::Bone& bone : from.bones()) {
    Result<Bone> read = decode_bone(bone, bones.size());
    if (!read) return read.error();
    bones.push_back(std::move(*read));
  }
  for (const v1::Marker& marker : from.markers()) {
    Result<MarkerOnBone> read = decode_marker(marker, bones.size());
    if (!read) return read.error();
    into.marker_set.markers.push_back(std::move(*read));
  }
  return into;
}

CameraPhase camera_phase_of(v1::CameraPhase code) {
  switch (code) {
    case v1::CAMERA_PHASE_STREAMING: return CameraPhase::Streaming;
    case v1::CAMERA_PHASE_SILENT: return CameraPhase::Silent;
    case v1::CAMERA_PHASE_REOPENING: return CameraPhase::Reopening;
    case v1::CAMERA_PHASE_ENDED: return CameraPhase::Ended;
    case v1::CAMERA_PHASE_STOPPED: return CameraPhase::Stopped;
    default: return CameraPhase::Starting;
  }
}

ClockSource clock_source_of(v1::ClockSource source) {
  const bool known = source >= v1::CLOCK_SOURCE_UNSPECIFIED && source <= v1::CLOCK_SOURCE_PTP;
  return known ? static_cast<ClockSource>(source) : ClockSource::Unknown;
}

RecordingState state_of(v1::RecordingState code) {
  switch (code) {
    case v1::RECORDING_STATE_ENDED: return RecordingState::Ended;
    case v1::RECORDING_STATE_FAILED: return RecordingState::Failed;
    default: return RecordingState::Recording;
  }
}

DetectionCounts detection_of(const v1::CameraHealth& from) {
  return {from.blobs(),         from.blobs_too_small(), from.blobs_too_large(), from.blobs_not_round(),
          from.blobs_too_dim(), from.dropped_blobs(),   from.rows_given_up()};
}

SearchHealth search_of(const v1::SearchHealth& from) {
  const bool known = from.cause() >= v1::SEARCH_CAUSE_UNSPECIFIED && from.cause() < kSearchCauses;
  SearchHealth into;
  into.subject = SubjectId{from.subject()};
  into.cause = known ? static_cast<SearchCause>(from.cause()) : SearchCause::None;
  into.points = from.points();
  into.still = from.still_points();
  into.markers = from.markers();
  into.explained = from.explained();
  const int missing = std::min({from.missing_markers_size(), from.missing_positions_m_size() / 3,
                                from.missing_in_view_of_size(), static_cast<int>(kMaxLabels)});
  for (int i = 0; i < missing; ++i) {
    const Eigen::Vector3d at(from.missing_positions_m(3 * i), from.missing_positions_m(3 * i + 1),
                             from.missing_positions_m(3 * i + 2));
    into.missing.push_back({from.missing_markers(i), WorldPoint{at}, from.missing_in_view_of(i)});
  }
  into.known_set = bounded_text<63>(from.known_set());
  into.known_set_markers = from.known_set_markers();
  into.sentence = bounded_text<511>(from.sentence());
  return into;
}

TakeHealth take_of(const v1::TakeHealth& from) {
  TakeHealth into;
  into.state = from.state() >= 1 && from.state() <= 5 ? static_cast<TakeState>(from.state()) : TakeState::Recording;
  into.name = bounded_text<255>(from.name());
  into.path = bounded_text<1023>(from.path());
  into.seconds = from.seconds();
  into.size_bytes = from.size_bytes();
  into.sets = from.sets();
  into.lost_sets = from.lost_sets();
  into.lost_images = from.lost_images();
  into.quality =
      from.quality() >= 0 && from.quality() <= 3 ? static_cast<TakeQuality>(from.quality()) : TakeQuality::Look;
  into.reasons = bounded_text<511>(from.reasons());
  into.message = bounded_text<511>(from.message());
  into.takes = from.takes();
  return into;
}

CameraHealth camera_health_of(const v1::CameraHealth& camera) {
  return {camera.name(),
          camera_phase_of(camera.phase()),
          camera.rate_hz(),
          camera.frames(),
          camera.missing_frames(),
          camera.failed_frames(),
          camera.dropped_queue_full(),
          camera.reopened(),
          camera.underruns(),
          camera.resent_packets(),
          camera.missing_packets(),
          camera.last_error(),
          detection_of(camera),
          {camera.threshold_grey(), camera.noise_grey(), camera.background_grey(), camera.brightest_grey()},
          !camera.has_synchronised() || camera.synchronised(),
          camera.offset_us(),
          camera.drift_us_s(),
          camera.jitter_us(),
          camera.repeated_frames(),
          camera.clock_leaps(),
          camera.clock_uncertainty_us(),
          camera.bumped(),
          camera.rig_off_px(),
          camera.rig_turned_rad(),
          camera.rig_moved_m(),
          clock_source_of(camera.clock_source()),
          camera.chunk_times(),
          {camera.fused_blobs(), camera.marker_blobs()},
          camera.has_marker_share() ? std::optional(camera.marker_share()) : std::nullopt};
}

TimecodeState state_of(v1::TimecodeState state) {
  switch (state) {
    case v1::TIMECODE_STATE_SEARCHING: return TimecodeState::Searching;
    case v1::TIMECODE_STATE_LOCKED: return TimecodeState::Locked;
    case v1::TIMECODE_STATE_COASTING: return TimecodeState::Coasting;
    default: return TimecodeState::Lost;
  }
}

AuditHealth audit_health_of(const v1::AuditHealth& from) {
  AuditHealth into;
  into.on = true;
  into.lines = from.lines();
  into.waiting = from.waiting();
  into.lost = from.lost();
  into.error = bounded_text<255>(from.error());
  return into;
}

TimecodeHealth timecode_health_of(const v1::Health& all) {
  const v1::TimecodeHealth& from = all.timecode();
  const Timestamp at = from_ns(all.at_ns());
  TimecodeHealth into;
  into.source = from.source() == v1::TIMECODE_SOURCE_UTC ? TimecodeSourceKind::Utc : TimecodeSourceKind::Ltc;
  into.state = state_of(from.state());
  if (from.has_age_s() && from.age_s() >= 0.0 && from.age_s() < kLongestAge_s) {
    into.last_frame_at = at - from_s(from.age_s());
  }
  if (const Timecode now = timecode_of(from.now()); from.has_now() && is_valid(now)) {
    into.clock = TimecodeClock{};
    into.clock->format = now;
    into.clock->at = at;
    into.clock->frames_at = static_cast<double>(frames_of(now));
    into.clock->frames_per_s = rate_hz(now);
  }
  into.drift_ppm = from.drift_ppm();
  into.frames = from.frames();
  into.rejected_frames = from.rejected_frames();
  into.jumps = from.jumps();
  into.sentence = bounded_text<255>(from.sentence());
  return into;
}

// A newer daemon may have stages that this reader does not know.
std::optional<std::size_t> index_of(v1::LatencyStage stage) {
  const auto index = static_cast<std::size_t>(stage - v1::LATENCY_STAGE_RECEIVE);
  return stage >= v1::LATENCY_STAGE_RECEIVE && index < kLatencyStages ? std::optional(index) : std::nullopt;
}

LatencyTotals totals_of(const v1::LatencyTotals& from) {
  LatencyTotals into;
  const std::size_t count = std::min(static_cast<std::size_t>(from.counts_size()), into.counts.size());
  std::copy_n(from.counts().begin(), count, into.counts.begin());
  if (std::abs(from.sum_s()) < 1e9) into.sum = from_s(from.sum_s());
  return into;
}

void decode_latencies(const v1::Health& from, Health& into) {
  for (const v1::StageLatency& stage : from.latencies()) {
    const std::optional<std::size_t> index = index_of(stage.stage());
    if (!index) continue;
    into.latency[*index] = {stage.count(), Duration(stage.p50_ns()), Duration(stage.p99_ns()),
                            Duration(stage.max_ns())};
  }
  for (const v1::LatencyTotals& stage : from.latency_totals()) {
    if (const std::optional<std::size_t> index = index_of(stage.stage()))
      into.latency_totals[*index] = totals_of(stage);
  }
}

}  // namespace

Result<Description> decode(const v1::Description& from) {
  if (const Status ours = check_conventions(from); !ours) return ours.error();
  if (static_cast<std::size_t>(from.cameras_size()) > kMaxCameras ||
      static_cast<std::size_t>(from.subjects_size()) > kMaxSubjects) {
    return wrong_description(fmt::format("{} cameras and {} subjects, at most {} and {} are allowed",
                                         from.cameras_size(), from.subjects_size(), kMaxCameras, kMaxSubjects));
  }
  Description into;
  into.version = from.version();
  into.producer = from.producer();
  into.session_id = from.session_id();
  into.nominal_rate_hz = from.nominal_rate_hz();
  for (const v1::Camera& camera : from.cameras()) {
    Result<CameraModel> read = decode_camera_model(camera);
    if (!read) return read.error();
    into.cameras.push_back(std::move(*read));
    into.camera_rates_hz.push_back(camera.nominal_rate_hz());
  }
  for (const v1::Subject& subject : from.subjects()) {
    Result<Subject> read = decode_subject_description(subject);
    if (!read) return read.error();
    into.subjects.push_back(std::move(*read));
  }
  return into;
}

Result<Health> decode(const v1::Health& from) {
  if (static_cast<std::size_t>(from.cameras_size()) > kMaxCameras) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("health: {} cameras, at most {} are allowed", from.cameras_size(), kMaxCameras)};
  }
  Health into;
  into.at = from_ns(from.at_ns());
  into.set_rate_hz = from.set_rate_hz();
  into.sets = from.sets();
  into.complete_sets = from.complete_sets();
  into.passed_over_sets = from.passed_over_sets();
  into.dropped_snapshots = from.dropped_snapshots();
  into.passed_over_snapshots = from.passed_over_snapshots();
  into.sent_snapshots = from.sent_snapshots();
  decode_latencies(from, into);
  for (const v1::CameraHealth& camera : from.cameras()) into.cameras.push_back(camera_health_of(camera));
  const v1::FeedHealth& feed = from.feed();
  into.feed = {feed.listeners(),         feed.connections(),     feed.disconnections(),
               feed.failed_handshakes(), feed.refused_clients(), feed.cut_off(),
               feed.subscriptions(),     feed.failed_accepts(),  feed.behind()};
  for (const v1::RecordingHealth& recording : from.recordings()) {
    into.recordings.push_back({recording.path(), state_of(recording.state()), recording.size_bytes(),
                               recording.records(), recording.error()});
  }
  for (int i = 0; i < std::min(from.searches_size(), static_cast<int>(kMaxSubjects)); ++i) {
    into.searches.push_back(search_of(from.searches(i)));
  }
  if (from.has_take()) into.take = take_of(from.take());
  if (from.has_timecode()) into.timecode = timecode_health_of(from);
  if (from.has_audit()) into.audit = audit_health_of(from.audit());
  return into;
}

}  // namespace mocap::wire
