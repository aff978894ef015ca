#include "settings/stage_keys.h"

#include "model/bounds.h"

namespace mocap::settings {
namespace {

// A section is a function with a line a key: its name in the file, its field, its range. A new stage is such a
// function and a line in kSections.

void tell_capture(KeyVisitor& keys, DaemonSettings& all) {
  keys.path("rig", all.capture.rig_file);
  keys.number("rate_hz", all.capture.rate_hz, {0, 10000});
  keys.flag("every_set", all.pipeline.fusion.every_set);
}

void tell_log(KeyVisitor& keys, DaemonSettings& all) {
  keys.choice<LogLevel>(
      "level", all.log_level,
      {{"debug", LogLevel::Debug}, {"info", LogLevel::Info}, {"warn", LogLevel::Warn}, {"error", LogLevel::Error}});
}

void tell_reopen(KeyVisitor& keys, DaemonSettings& all) {
  runtime::CameraWorkerSettings& camera = all.pipeline.camera;
  keys.time("silent_after_ms", camera.silent_after, {10, 60000});
  keys.time("first_image_within_ms", camera.first_image_within, {10, 600000});
  keys.time("first_backoff_ms", camera.first_backoff, {1, 60000});
  keys.time("longest_backoff_ms", camera.longest_backoff, {1, 600000});
}

void tell_detect(KeyVisitor& keys, DaemonSettings& all) {
  detect::DetectSettings& detect = all.detect;
  keys.number("threshold", detect.threshold, {1, 255});
  keys.number("low_threshold", detect.low_threshold, {0, 255});
  keys.number("min_area_px2", detect.min_area_px2, {1, 1e6});
  keys.number("max_area_px2", detect.max_area_px2, {1, 1e6});
  keys.number("min_roundness", detect.min_roundness, {0, 1});
  keys.number("min_peak_grey", detect.min_peak_grey, {0, 255});
  keys.flag("split_touching", detect.split_touching);
  keys.number("grow_px", detect.grow_px, {0, 8});
}

void tell_track_blobs(KeyVisitor& keys, DaemonSettings& all) {
  track2d::TrackBlobsSettings& track = all.track_blobs;
  keys.choice<track2d::TrackMethod>("method", track.method,
                                    {{"alpha_beta", track2d::TrackMethod::AlphaBeta},
                                     {"adaptive_alpha_beta", track2d::TrackMethod::AdaptiveAlphaBeta},
                                     {"kalman", track2d::TrackMethod::Kalman},
                                     {"condensation", track2d::TrackMethod::Condensation}});
  keys.number("gate_sigmas", track.gate_sigmas, {1, 10});
  keys.number("gate_floor_px", track.gate_floor_px, {0, 100});
  keys.number("gate_per_speed", track.gate_per_speed, {0, 2});
  keys.number("gate_growth_px_s", track.gate_growth_px_s, {0, 10000});
  keys.number("confirm_images", track.confirm_images, {1, 100});
  keys.time("max_coast_ms", track.max_coast, {0, 10000});
  keys.number("acceleration_px_s2", track.acceleration_px_s2, {1, 1e6});
  keys.number("birth_speed_px_s", track.birth_speed_px_s, {1, 1e5});
  keys.number("alpha", track.alpha, {0, 1});
  keys.number("beta", track.beta, {0, 2});
  keys.number("alpha_beta_gate_px", track.alpha_beta_gate_px, {0.1, 100});
  keys.number("particles", track.particles, {2, 256});
  keys.number("seed", track.seed, {0, 9e15});
}

void tell_align(KeyVisitor& keys, DaemonSettings& all) {
  keys.time("window_us", all.pipeline.align.window, {1, 1e6});
  keys.time("patience_us", all.pipeline.align.patience, {0, 1e7});
}

void tell_match(KeyVisitor& keys, DaemonSettings& all) {
  constexpr KeyRange kPlace_m{-1000, 1000};
  associate::MatchSettings& match = all.match;
  keys.number("gate_sigmas", match.gate_sigmas, {1, 10});
  keys.number("gate_floor_px", match.gate_floor_px, {0, 100});
  keys.number("calibration_px", match.calibration_px, {0, 20});
  keys.number("agree_sigmas", match.agree_sigmas, {1, 10});
  keys.number("min_views_new", match.min_views_new, {2, kMaxCameras});
  keys.number("min_ray_angle_deg", match.min_ray_angle_deg, {0.1, 45});
  keys.numbers("volume_min_m", {match.volume_min_m.data(), 3}, kPlace_m);
  keys.numbers("volume_max_m", {match.volume_max_m.data(), 3}, kPlace_m);
}

void tell_triangulate(KeyVisitor& keys, DaemonSettings& all) {
  associate::TriangulateSettings& triangulate = all.triangulate;
  keys.number("calibration_px", triangulate.calibration_px, {0, 20});
  keys.number("agree_sigmas", triangulate.agree_sigmas, {1, 10});
  keys.millimetres("max_sigma_mm", triangulate.max_sigma_m, {0.01, 1000});
}

void tell_track_markers(KeyVisitor& keys, DaemonSettings& all) {
  track3d::TrackMarkersSettings& track = all.track_markers;
  keys.number("gate_sigmas", track.gate_sigmas, {1, 10});
  keys.millimetres("gate_floor_mm", track.gate_floor_m, {0, 100});
  keys.number("gate_per_speed", track.gate_per_speed, {0, 2});
  keys.number("confirm_sets", track.confirm_sets, {1, 100});
  keys.time("max_coast_ms", track.max_coast, {0, 10000});
  keys.millimetres("max_coast_sigma_mm", track.max_coast_sigma_m, {1, 10000});
  keys.number("acceleration_m_s2", track.acceleration_m_s2, {0.01, 1000});
  keys.number("acceleration_per_speed_1_s", track.acceleration_per_speed_1_s, {0, 100});
  keys.number("max_agility", track.max_agility, {1, 1000});
  keys.number("birth_speed_m_s", track.birth_speed_m_s, {0.01, 100});
  keys.time("coast_half_life_ms", track.coast_half_life, {0, 10000});
  keys.millimetres("sighting_floor_mm", track.sighting_floor_m, {0, 100});
}

void tell_label(KeyVisitor& keys, DaemonSettings& all) {
  label::LabelSettings& label = all.label;
  keys.time("still_for_ms", label.still_for, {0, 10000});
  keys.millimetres("still_radius_mm", label.still_radius_m, {0.1, 1000});
  keys.time("search_every_ms", label.search_every, {1, 10000});
  keys.millimetres("most_rms_mm", label.most_rms_m, {0.1, 1000});
  keys.number("least_share", label.least_share, {0.1, 1});
  keys.millimetres("rigid_tolerance_mm", label.rigid_tolerance_m, {0.1, 1000});
  keys.millimetres("tie_slack_mm", label.tie_slack_m, {0, 1000});
  keys.millimetres("most_gate_mm", label.most_gate_m, {1, 5000});
  keys.time("lost_after_ms", label.lost_after, {1, 60000});
}

void tell_solve(KeyVisitor& keys, DaemonSettings& all) {
  solve::SolveSettings& solve = all.solve;
  keys.millimetres("marker_sigma_mm", solve.marker_sigma_m, {0.1, 100});
  keys.millimetres("outlier_mm", solve.outlier_m, {1, 1000});
  keys.number("fill_for_s", solve.fill_for_s, {0, 60});
  keys.number("max_iterations", solve.max_iterations, {1, 100});
  keys.number("smoothing_min_cutoff_hz", solve.smoothing.min_cutoff_hz, {0, 100});
  keys.number("smoothing_beta", solve.smoothing.beta, {0, 100});
}

void tell_refine(KeyVisitor& keys, DaemonSettings& all) {
  solve::RefineSettings& refine = all.refine;
  keys.number("instants", refine.instants, {0, 200});
  keys.time("look_every_ms", refine.look_every, {1, 10000});
  keys.number("pieces", refine.pieces, {1, 100});
  keys.number("least_gain", refine.least_gain, {0, 1});
}

void tell_watch(KeyVisitor& keys, DaemonSettings& all) {
  keys.number("drift_px", all.drift.drift_px, {0, 100});
  keys.number("reach_deg", all.drift.reach_deg, {0.1, 5});
  keys.number("memory_s", all.drift.memory_s, {0.5, 600});
}

void tell_publish(KeyVisitor& keys, DaemonSettings& all) {
  keys.text("endpoint", all.publish.endpoint);
  keys.texts("more_endpoints", all.publish.more_endpoints);
  keys.flag("allow_remote", all.publish.allow_remote);
  keys.number("max_connections", all.publish.max_connections, {1, 60000});
  keys.number("send_queue", all.publish.send_queue, {1, 1000});
  keys.flag("velocities", all.publish.velocities);
  keys.flag("every_snapshot", all.pipeline.publish.every_snapshot);
}

void tell_control(KeyVisitor& keys, DaemonSettings& all) {
  keys.text("endpoint", all.control.endpoint);
  keys.texts("more_endpoints", all.control.more_endpoints);
  keys.flag("allow_remote", all.control.allow_remote);
  keys.choice<wire::Role>("role_without_keys", all.control.role_without_keys,
                          {{"viewer", wire::Role::Viewer}, {"operator", wire::Role::Operator}});
}

void tell_security(KeyVisitor& keys, DaemonSettings& all) {
  keys.path("server_key", all.publish.curve.server_key);
  keys.path("allowed_keys", all.publish.curve.allowed);
  all.control.curve = all.publish.curve;
}

void tell_record(KeyVisitor& keys, DaemonSettings& all) {
  keys.path("snapshots", all.record.snapshots);
  keys.path("blobs", all.record.blobs);
}

void tell_queues(KeyVisitor& keys, DaemonSettings& all) {
  keys.number("camera_frames", all.pipeline.camera_queue_frames, {2, 1024});
  keys.number("publish_snapshots", all.pipeline.publish_queue_snapshots, {2, 1024});
  keys.number("side_snapshots", all.pipeline.side_queue_snapshots, {2, 4096});
}

void tell_realtime(KeyVisitor& keys, DaemonSettings& all) {
  constexpr KeyRange kPriority{0, 99};
  constexpr KeyRange kCpu{0, 1023};  // CPU_SETSIZE
  runtime::PipelineSettings& pipeline = all.pipeline;
  keys.choice<runtime::Waiting>("wait", pipeline.fusion.waiting,
                                {{"sleep", runtime::Waiting::Sleep}, {"spin", runtime::Waiting::Spin}});
  pipeline.publish.waiting = pipeline.fusion.waiting;
  keys.flag("lock_memory", all.lock_memory);
  keys.number("camera_fifo_priority", pipeline.camera.thread.fifo_priority, kPriority);
  keys.whole_numbers("camera_cpus", pipeline.camera.thread.cpus, kCpu);
  keys.number("fusion_fifo_priority", pipeline.fusion.thread.fifo_priority, kPriority);
  keys.whole_numbers("fusion_cpus", pipeline.fusion.thread.cpus, kCpu);
  keys.number("publish_fifo_priority", pipeline.publish.thread.fifo_priority, kPriority);
  keys.whole_numbers("publish_cpus", pipeline.publish.thread.cpus, kCpu);
}

constexpr Section kSections[] = {
    {"capture", tell_capture},  //
    {"log", tell_log},          //
    {"detect", tell_detect},    //
    {"track", tell_track_blobs},
    {"align", tell_align},  //
    {"match", tell_match},
    {"triangulate", tell_triangulate},
    {"track_markers", tell_track_markers},
    {"label", tell_label},
    {"solve", tell_solve},
    {"refine", tell_refine},
    {"watch", tell_watch},      //
    {"publish", tell_publish},  //
    {"control", tell_control},  //
    {"security", tell_security},
    {"record", tell_record},  //
    {"reopen", tell_reopen},  //
    {"queues", tell_queues},  //
    {"realtime", tell_realtime},
};

}  // namespace

std::span<const Section> sections() { return kSections; }

}  // namespace mocap::settings
