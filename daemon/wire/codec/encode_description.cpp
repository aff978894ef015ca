#include <algorithm>

#include "wire/codec/encode.h"
#include "wire/codec/encode_numbers.h"
#include "wire/codec/utf8.h"

namespace mocap::wire {
namespace {

void encode_vector(const Eigen::Vector3d& from, v1::Vector3& into) {
  into.set_x(from.x());
  into.set_y(from.y());
  into.set_z(from.z());
}

void encode_conventions(v1::Conventions& into) {
  into.set_length_unit(v1::LENGTH_UNIT_METRE);
  into.set_handedness(v1::HANDEDNESS_RIGHT);
  into.set_up_axis(v1::AXIS_Z);
  into.set_quaternion_order(v1::QUATERNION_ORDER_XYZW);
  into.set_clock(v1::CLOCK_HOST_MONOTONIC);
}

void encode_camera(const CameraModel& from, v1::Camera& into) {
  into.set_name(valid_utf8(from.name));
  into.set_width_px(static_cast<std::uint32_t>(from.width_px));
  into.set_height_px(static_cast<std::uint32_t>(from.height_px));
  into.set_lens_kind(from.lens.kind == LensKind::Fisheye ? v1::LENS_KIND_FISHEYE : v1::LENS_KIND_PINHOLE);
  into.set_fx_px(from.lens.fx_px);
  into.set_fy_px(from.lens.fy_px);
  into.set_cx_px(from.lens.cx_px);
  into.set_cy_px(from.lens.cy_px);
  for (const double k : from.lens.distortion) into.add_distortion(k);
  const Eigen::Quaterniond q = Eigen::Quaterniond(from.camera_from_world.rotation).normalized();
  v1::Quaternion& rotation = *into.mutable_camera_from_world_rotation();
  rotation.set_x(q.x());
  rotation.set_y(q.y());
  rotation.set_z(q.z());
  rotation.set_w(q.w());
  encode_vector(from.camera_from_world.translation, *into.mutable_camera_from_world_translation_m());
}

void encode_angle_range(const AngleRange& from, v1::AngleRange& into) {
  into.set_min_rad(from.min_rad);
  into.set_max_rad(from.max_rad);
}

void encode_bone(const Bone& from, v1::Bone& into) {
  into.set_name(valid_utf8(from.name));
  if (from.parent >= 0) into.set_parent(static_cast<std::uint32_t>(from.parent));
  encode_vector(from.rest_offset_m, *into.mutable_rest_offset_m());
  if (from.rotation_limits[0]) encode_angle_range(*from.rotation_limits[0], *into.mutable_turn_x());
  if (from.rotation_limits[1]) encode_angle_range(*from.rotation_limits[1], *into.mutable_turn_y());
  if (from.rotation_limits[2]) encode_angle_range(*from.rotation_limits[2], *into.mutable_turn_z());
  into.set_unity_name(valid_utf8(from.aliases.unity));
  into.set_unreal_name(valid_utf8(from.aliases.unreal));
  into.set_vrm_name(valid_utf8(from.aliases.vrm));
}

void encode_subject(const Subject& from, v1::Subject& into) {
  into.set_name(valid_utf8(from.name));
  into.set_marker_set(valid_utf8(from.marker_set.name));
  into.set_skeleton(valid_utf8(from.marker_set.skeleton.name));
  for (const Bone& bone : from.marker_set.skeleton.bones) encode_bone(bone, *into.add_bones());
  for (const MarkerOnBone& marker : from.marker_set.markers) {
    v1::Marker& to = *into.add_markers();
    to.set_name(valid_utf8(marker.name));
    to.set_bone(static_cast<std::uint32_t>(marker.bone));
    encode_vector(marker.offset_m, *to.mutable_offset_m());
    for (const float c : marker.colour) to.add_colour_rgb(c);
  }
}

v1::LatencyStage stage_code_of(LatencyStage stage) {
  switch (stage) {
    case LatencyStage::Receive: return v1::LATENCY_STAGE_RECEIVE;
    case LatencyStage::Detect: return v1::LATENCY_STAGE_DETECT;
    case LatencyStage::Fuse: return v1::LATENCY_STAGE_FUSE;
    case LatencyStage::Send: return v1::LATENCY_STAGE_SEND;
    case LatencyStage::Total: return v1::LATENCY_STAGE_TOTAL;
  }
  return v1::LATENCY_STAGE_UNSPECIFIED;
}

v1::CameraPhase camera_code_of(CameraPhase phase) {
  switch (phase) {
    case CameraPhase::Starting: return v1::CAMERA_PHASE_STARTING;
    case CameraPhase::Streaming: return v1::CAMERA_PHASE_STREAMING;
    case CameraPhase::Silent: return v1::CAMERA_PHASE_SILENT;
    case CameraPhase::Reopening: return v1::CAMERA_PHASE_REOPENING;
    case CameraPhase::Ended: return v1::CAMERA_PHASE_ENDED;
    case CameraPhase::Stopped: return v1::CAMERA_PHASE_STOPPED;
  }
  return v1::CAMERA_PHASE_UNSPECIFIED;
}

void encode_camera_health(const CameraHealth& from, v1::CameraHealth& into) {
  assign_valid_utf8(from.name, *into.mutable_name());
  into.set_phase(camera_code_of(from.phase));
  into.set_rate_hz(from.rate_hz);
  into.set_frames(from.frames);
  into.set_missing_frames(from.missing_frames);
  into.set_failed_frames(from.failed_frames);
  into.set_dropped_queue_full(from.dropped_queue_full);
  into.set_dropped_blobs(from.detection.dropped);
  into.set_reopened(from.reopened);
  into.set_underruns(from.underruns);
  into.set_resent_packets(from.resent_packets);
  into.set_missing_packets(from.missing_packets);
  into.set_blobs(from.detection.blobs);
  into.set_blobs_too_small(from.detection.too_small);
  into.set_blobs_too_large(from.detection.too_large);
  into.set_blobs_not_round(from.detection.not_round);
  into.set_blobs_too_dim(from.detection.too_dim);
  into.set_rows_given_up(from.detection.rows_given_up);
  if (from.levels.threshold_grey > 0.0) {
    into.set_threshold_grey(from.levels.threshold_grey);
    into.set_noise_grey(from.levels.noise_grey);
    into.set_background_grey(from.levels.background_grey);
  }
  if (from.levels.brightest_grey > 0.0) into.set_brightest_grey(from.levels.brightest_grey);
  into.set_synchronised(from.synchronised);
  into.set_offset_us(from.offset_us);
  into.set_drift_us_s(from.drift_us_s);
  into.set_jitter_us(from.jitter_us);
  into.set_repeated_frames(from.repeated_frames);
  into.set_clock_leaps(from.clock_leaps);
  into.set_clock_uncertainty_us(from.clock_uncertainty_us);
  into.set_bumped(from.bumped);
  into.set_rig_off_px(from.rig_off_px);
  into.set_rig_turned_rad(from.rig_turned_rad);
  into.set_rig_moved_m(from.rig_moved_m);
  into.set_clock_source(static_cast<v1::ClockSource>(from.clock_source));
  into.set_chunk_times(from.chunk_times);
  into.set_fused_blobs(from.blob_use.blobs);
  into.set_marker_blobs(from.blob_use.in_markers);
  if (from.marker_share) into.set_marker_share(*from.marker_share);
  assign_valid_utf8(from.last_error, *into.mutable_last_error());
}

v1::RecordingState recording_code_of(RecordingState state) {
  switch (state) {
    case RecordingState::Recording: return v1::RECORDING_STATE_RECORDING;
    case RecordingState::Ended: return v1::RECORDING_STATE_ENDED;
    case RecordingState::Failed: return v1::RECORDING_STATE_FAILED;
  }
  return v1::RECORDING_STATE_UNSPECIFIED;
}

void encode_recording(const RecordingHealth& from, v1::RecordingHealth& into) {
  assign_valid_utf8(from.path, *into.mutable_path());
  into.set_state(recording_code_of(from.state));
  into.set_size_bytes(from.size_bytes);
  into.set_records(from.records);
  assign_valid_utf8(from.error, *into.mutable_error());
}

void encode_search(const SearchHealth& from, v1::SearchHealth& into) {
  into.set_subject(from.subject.value);
  into.set_cause(static_cast<v1::SearchCause>(from.cause));
  into.set_points(from.points);
  into.set_still_points(from.still);
  into.set_markers(from.markers);
  into.set_explained(from.explained);
  for (const MissingMarker& missing : from.missing) {
    into.add_missing_markers(missing.marker);
    for (const double each : missing.position.v) into.add_missing_positions_m(static_cast<float>(each));
    into.add_missing_in_view_of(missing.in_view_of);
  }
  assign_valid_utf8(text_of(from.known_set), *into.mutable_known_set());
  into.set_known_set_markers(from.known_set_markers);
  assign_valid_utf8(text_of(from.sentence), *into.mutable_sentence());
}

void encode_take(const TakeHealth& from, v1::TakeHealth& into) {
  into.set_state(static_cast<v1::TakeState>(from.state));  // the values are equal
  into.set_name(valid_utf8(std::string(text_of(from.name))));
  into.set_path(valid_utf8(std::string(text_of(from.path))));
  into.set_seconds(from.seconds);
  into.set_size_bytes(from.size_bytes);
  into.set_sets(from.sets);
  into.set_lost_sets(from.lost_sets);
  into.set_lost_images(from.lost_images);
  into.set_quality(static_cast<v1::TakeQuality>(from.quality));  // the values are equal
  into.set_reasons(valid_utf8(std::string(text_of(from.reasons))));
  into.set_message(valid_utf8(std::string(text_of(from.message))));
  into.set_takes(from.takes);
}

void encode_audit(const AuditHealth& from, v1::AuditHealth& into) {
  into.set_lines(from.lines);
  into.set_waiting(from.waiting);
  into.set_lost(from.lost);
  into.set_error(valid_utf8(text_of(from.error)));
}

void encode_timecode(const Health& all, v1::TimecodeHealth& into) {
  const TimecodeHealth& from = all.timecode;
  into.set_source(static_cast<v1::TimecodeSource>(from.source));                     // the values are equal
  into.set_state(static_cast<v1::TimecodeState>(static_cast<int>(from.state) + 1));  // in the same order
  into.set_locked(from.state == TimecodeState::Locked);
  if (from.last_frame_at) into.set_age_s(std::max(0.0, to_s(all.at - *from.last_frame_at)));
  if (const auto now = from.clock ? timecode_at(*from.clock, all.at) : std::nullopt) encode(*now, *into.mutable_now());
  into.set_drift_ppm(from.drift_ppm);
  into.set_frames(from.frames);
  into.set_rejected_frames(from.rejected_frames);
  into.set_jumps(from.jumps);
  into.set_sentence(valid_utf8(std::string(text_of(from.sentence))));
}

}  // namespace

v1::Description encode(const Description& from) {
  v1::Description into;
  into.set_protocol(kProtocol);
  into.set_protocol_revision(kProtocolRevision);
  into.set_version(from.version);
  into.set_producer(valid_utf8(from.producer));
  into.set_session_id(valid_utf8(from.session_id));
  encode_conventions(*into.mutable_conventions());
  into.set_nominal_rate_hz(from.nominal_rate_hz);
  for (std::size_t i = 0; i < from.cameras.size(); ++i) {
    v1::Camera& camera = *into.add_cameras();
    encode_camera(from.cameras[i], camera);
    if (i < from.camera_rates_hz.size()) camera.set_nominal_rate_hz(from.camera_rates_hz[i]);
  }
  for (const Subject& subject : from.subjects) encode_subject(subject, *into.add_subjects());
  return into;
}

namespace {

void encode_totals(const Health& from, v1::Health& into) {
  for (const Duration bound : kLatencyBounds) into.add_latency_bounds_s(to_s(bound));
  for (std::size_t i = 0; i < kLatencyStages; ++i) {
    const LatencyTotals& totals = from.latency_totals[i];
    if (std::ranges::count(totals.counts, 0U) == std::ssize(totals.counts)) continue;
    v1::LatencyTotals& to = *into.add_latency_totals();
    to.set_stage(stage_code_of(static_cast<LatencyStage>(i)));
    for (const std::uint64_t count : totals.counts) to.add_counts(count);
    to.set_sum_s(to_s(totals.sum));
  }
}

}  // namespace

void encode(const Health& from, v1::Health& into) {
  into.Clear();
  into.set_at_ns(to_ns(from.at));
  into.set_set_rate_hz(from.set_rate_hz);
  into.set_sets(from.sets);
  into.set_complete_sets(from.complete_sets);
  into.set_passed_over_sets(from.passed_over_sets);
  into.set_dropped_snapshots(from.dropped_snapshots);
  into.set_passed_over_snapshots(from.passed_over_snapshots);
  into.set_sent_snapshots(from.sent_snapshots);
  for (std::size_t i = 0; i < kLatencyStages; ++i) {
    const LatencyFigures& figures = from.latency[i];
    if (figures.count == 0) continue;
    v1::StageLatency& to = *into.add_latencies();
    to.set_stage(stage_code_of(static_cast<LatencyStage>(i)));
    to.set_count(figures.count);
    to.set_p50_ns(figures.p50.count());
    to.set_p99_ns(figures.p99.count());
    to.set_max_ns(figures.max.count());
  }
  encode_totals(from, into);
  for (const CameraHealth& camera : from.cameras) encode_camera_health(camera, *into.add_cameras());
  v1::FeedHealth& feed = *into.mutable_feed();
  feed.set_listeners(from.feed.listeners);
  feed.set_connections(from.feed.connections);
  feed.set_disconnections(from.feed.disconnections);
  feed.set_failed_handshakes(from.feed.failed_handshakes);
  feed.set_refused_clients(from.feed.refused_clients);
  feed.set_cut_off(from.feed.cut_off);
  feed.set_subscriptions(from.feed.subscriptions);
  feed.set_failed_accepts(from.feed.failed_accepts);
  feed.set_behind(from.feed.behind);
  for (const RecordingHealth& recording : from.recordings) encode_recording(recording, *into.add_recordings());
  for (const SearchHealth& search : from.searches) encode_search(search, *into.add_searches());
  if (from.take.state != TakeState::None) encode_take(from.take, *into.mutable_take());
  if (from.timecode.source != TimecodeSourceKind::None) encode_timecode(from, *into.mutable_timecode());
  if (from.audit.on) encode_audit(from.audit, *into.mutable_audit());
}

}  // namespace mocap::wire
