#include "assemble.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "assemble_camera.h"
#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "associate/uncalibrated_views.h"
#include "base/log.h"
#include "calibration/floor/floor_calibrator.h"
#include "calibration/order_calibrator.h"
#include "calibration/plugin_calibrator.h"
#include "cameras/aravis/usb_bandwidth.h"
#include "cameras/jpeg_encoder.h"
#include "cameras/node/node_settings.h"
#include "cameras/open_camera.h"
#include "cameras/ptp/pmc_clock.h"
#include "explain/search_explainer.h"
#include "fusion/idle_parts.h"
#include "label/body_labeller.h"
#include "model/calibration/calibrated_camera.h"
#include "settings/packed_files.h"
#include "settings/rig/rig_file.h"
#include "settings/same_settings.h"
#include "settings/subject/shipped_marker_sets.h"
#include "settings/subject/subject_keeper.h"
#include "solve/subject_refiner.h"
#include "solve/tree_solver.h"
#include "take/recorder/take_recorder.h"
#include "take/recordings/blob_recording.h"
#include "take/recordings/snapshot_writer.h"
#include "timecode/timecode_sources.h"
#include "track3d/kalman_marker_tracker.h"
#include "trigger/desk.h"
#include "trigger/udp_port.h"
#include "wire/endpoint.h"
#include "wire/zmq_control.h"
#include "wire/zmq_node_server.h"
#include "wire/zmq_publisher.h"

namespace mocap {
namespace {

// Time from the construction of the cameras to the first simulated exposure; all cameras are ready by then.
constexpr Duration kReadyWithin = std::chrono::milliseconds(200);

// Returns an id of this run, by which a client detects a restart of the daemon. The id of a replay is constant, so that
// its output is reproducible.
std::string session_id(bool replay) {
  if (replay) return "replay";
  std::random_device entropy;
  return fmt::format("{:08x}{:08x}", entropy(), entropy());
}

// Logs the USB bandwidth that the connected cameras need on each controller.
void log_usb_loads(const settings::DaemonSettings& settings) {
  for (const cameras::UsbLoad& load : cameras::usb_loads(settings.cameras, settings.rig)) {
    if (load.too_much()) {
      log_warn("cameras", load.text() + "; plug a camera into another controller or a faster port, or lower rate_hz");
    } else {
      log_info("cameras", load.text());
    }
  }
}

// A topic for each subject that a reload may add.
Result<std::unique_ptr<Publisher>> open_publisher(const settings::DaemonSettings& settings, AuditTrail* audit) {
  wire::PublisherSettings feed = settings.publish;
  feed.subjects = kMaxSubjects;
  return wire::make_zmq_publisher(feed, audit);
}

// Empty if the configuration has no control endpoint.
std::string control_endpoint(const settings::DaemonSettings& settings) {
  if (settings.control.endpoint == "none") return {};
  return settings.control.endpoint.empty() ? wire::control_beside(settings.publish.endpoint)
                                           : settings.control.endpoint;
}

// Null if the configuration has no control endpoint.
Result<std::unique_ptr<ControlServer>> open_control(const settings::DaemonSettings& settings, AuditTrail* audit) {
  wire::ControlSettings listening = settings.control;
  listening.endpoint = control_endpoint(settings);
  if (listening.endpoint.empty()) return std::unique_ptr<ControlServer>{};
  Result<std::unique_ptr<wire::ZmqControl>> control = wire::ZmqControl::open(listening, audit);
  if (!control) return control.error();
  return std::unique_ptr<ControlServer>(std::move(*control));
}

// All endpoints at which a daemon with these settings listens.
std::vector<std::string> endpoints_of(const settings::DaemonSettings& settings) {
  std::vector<std::string> all;
  const auto add = [&](const std::string& endpoint, const std::vector<std::string>& more) {
    if (endpoint.empty() || endpoint == "none") return;
    all.push_back(endpoint);
    all.insert(all.end(), more.begin(), more.end());
  };
  add(settings.publish.endpoint, settings.publish.more_endpoints);
  add(control_endpoint(settings), settings.control.more_endpoints);
  if (settings.node.on()) add(settings.node.endpoint, settings.node.more_endpoints);
  return all;
}

// Appends the writer of the recording of snapshots, if there is one.
Status open_snapshots(const settings::DaemonSettings& settings, const Description& description,
                      std::vector<std::unique_ptr<Writer>>& writers) {
  if (settings.record.snapshots.empty()) return {};
  Result<std::unique_ptr<Writer>> writer = take::make_snapshot_writer(settings.record.snapshots, description);
  if (!writer) return writer.error();
  writers.push_back(std::move(*writer));
  return {};
}

std::vector<take::RecordedCamera> recorded_cameras(const settings::DaemonSettings& settings) {
  std::vector<take::RecordedCamera> cameras;
  for (const CameraModel& camera : settings.rig) cameras.push_back({camera.name, camera.width_px, camera.height_px});
  return cameras;
}

bool same_recorded(const take::RecordedCamera& one, const take::RecordedCamera& other) {
  return one.name == other.name && one.width_px == other.width_px && one.height_px == other.height_px;
}

// Null if blobs are not recorded.
Result<std::unique_ptr<BlobWriter>> open_blobs(const settings::DaemonSettings& settings) {
  if (settings.record.blobs.empty()) return std::unique_ptr<BlobWriter>{};
  return take::make_blob_writer(settings.record.blobs, recorded_cameras(settings));
}

// The files that a take carries, as they are when the configuration comes into force.
std::vector<TakeFile> take_files(const settings::DaemonSettings& settings) {
  std::vector<TakeFile> files;
  for (settings::PackedFile& packed : settings::pack_files(settings)) {
    files.push_back({.name = std::move(packed.name), .bytes = std::move(packed.bytes)});
  }
  return files;
}

// Not in a replay, whose blobs are recorded already, not on a node, whose fusion host records them, and not if nobody
// can ask for a take.
bool records_takes(const settings::DaemonSettings& settings) {
  return !is_replay(settings) && !settings.node.on() &&
         (settings.control.endpoint != "none" || settings.trigger.listens());
}

// Null if no takes are recorded.
std::unique_ptr<TakeRecorder> make_takes(const settings::DaemonSettings& settings, const Description& description) {
  if (!records_takes(settings)) return nullptr;
  return take::make_take_recorder(settings.takes, description, take_files(settings));
}

// Whether the sockets of the triggers continue.
bool same_trigger(const settings::DaemonSettings& before, const settings::DaemonSettings& now) {
  return settings::same_section(before, now, "trigger") && records_takes(before) == records_takes(now);
}

// Null if takes have no remote triggers.
Result<std::unique_ptr<runtime::TriggerParts>> open_trigger(const settings::DaemonSettings& settings) {
  const trigger::TriggerSettings& wanted = settings.trigger;
  if (!records_takes(settings) || !(wanted.listens() || wanted.has_receivers())) {
    return std::unique_ptr<runtime::TriggerParts>{};
  }
  Result<std::unique_ptr<DatagramPort>> port = trigger::open_udp_port(wanted);
  if (!port) return port.error();
  // Seconds since 1970: fewer packets than seconds. Vicon refuses numbers over 1e10.
  const std::int64_t utc_s = (to_ns(host_now()) + utc_minus_host().count()) / 1'000'000'000;
  auto parts = std::make_unique<runtime::TriggerParts>();
  parts->desk = trigger::make_desk(wanted, static_cast<std::uint64_t>(utc_s));
  parts->port = std::move(*port);
  if (wanted.listens()) {
    log_info("trigger",
             fmt::format("takes are started and stopped by UDP packets of {}", fmt::join(wanted.senders, ", ")));
  }
  return parts;
}

// Null in a replay, whose time is that of the recording.
std::unique_ptr<TimecodeSource> make_timecode(const settings::DaemonSettings& settings) {
  if (is_replay(settings)) return nullptr;
  return timecode::make_timecode_source(settings.timecode, settings.nominal_rate_hz);
}

// Whether this daemon converts times between machines, as a node or as a fusion host.
bool has_clocks_of_nodes(const settings::DaemonSettings& settings) {
  const auto comes_from_a_node = [](const cameras::CameraSettings& camera) {
    return camera.driver.as<cameras::NodeCameraSettings>() != nullptr;
  };
  return !is_replay(settings) && (settings.node.on() || std::ranges::any_of(settings.cameras, comes_from_a_node));
}

// Null if this daemon is no node.
Result<std::unique_ptr<NodeServer>> open_node(const settings::DaemonSettings& settings, const PtpClock* ptp,
                                              AuditTrail* audit) {
  if (!settings.node.on()) return std::unique_ptr<NodeServer>{};
  Result<std::unique_ptr<wire::ZmqNodeServer>> node = wire::ZmqNodeServer::open(
      {.node = settings.node, .recorded = is_replay(settings), .control = control_endpoint(settings), .ptp = ptp},
      audit);
  if (!node) return node.error();
  return std::unique_ptr<NodeServer>(std::move(*node));
}

// Null in a replay, which mocap-calibrate calibrates. One thread, so that the pipeline keeps the other processors.
std::unique_ptr<RigCalibrator> make_calibrator(const settings::DaemonSettings& settings) {
  constexpr int kSolverThreads = 1;
  if (is_replay(settings)) return nullptr;
  return std::make_unique<calibration::OrderCalibrator>(
      std::make_unique<calibration::PluginCalibrator>(
          calibration::RigBefore{settings.rig, settings::floor_is_guessed(settings.capture.rig_file)}, kSolverThreads),
      std::make_unique<calibration::FloorCalibrator>(settings.rig));
}

}  // namespace

Description describe(const settings::DaemonSettings& settings, std::string session_id) {
  Description description;
  description.producer = "mocapd " MOCAP_VERSION;
  description.session_id = std::move(session_id);
  description.nominal_rate_hz = settings.nominal_rate_hz;
  description.cameras = settings.rig;
  for (const cameras::CameraSettings& camera : settings.cameras)
    description.camera_rates_hz.push_back(facts_of(camera).rate_hz.value_or(0.0));
  description.subjects = settings.subject_models;
  return description;
}

fusion::FusionParts assemble_fusion_parts(const settings::DaemonSettings& settings) {
  if (settings.node.on()) return fusion::make_idle_parts();
  fusion::FusionParts row;
  const Rig rig = associate::with_blind_models(settings.rig);
  row.matcher = associate::without_uncalibrated_views(associate::make_matcher(settings.match, rig), settings.rig);
  row.triangulator = associate::make_triangulator(settings.triangulate, rig);
  row.tracker = track3d::make_marker_tracker(settings.track_markers);
  row.labeller = label::make_labeller(settings.label, settings.subject_models);
  row.solver = solve::make_skeleton_solver(settings.solve, settings.subject_models);
  if (settings.refine.instants > 0) {
    row.refiner = std::make_unique<solve::SubjectRefiner>(settings.refine, settings.subject_models);
  }
  if (settings.drift.drift_px > 0.0) row.drift = std::make_unique<drift::DriftWatch>(settings.drift, rig);
  return row;
}

std::unique_ptr<fusion::Fusion> assemble_fusion(const settings::DaemonSettings& settings) {
  return std::make_unique<fusion::Fusion>(assemble_fusion_parts(settings),
                                          static_cast<std::uint32_t>(settings.rig.size()));
}

std::unique_ptr<SearchExplainer> assemble_explainer(const settings::DaemonSettings& settings) {
  const explain::ExplainSettings thresholds{.least_share = settings.label.least_share,
                                            .most_rms_m = settings.label.most_rms_m,
                                            .rigid_tolerance_m = settings.label.rigid_tolerance_m,
                                            .min_views_new = settings.match.min_views_new,
                                            .still_for = settings.label.still_for};
  return explain::make_search_explainer(thresholds, associate::with_blind_models(settings.rig), settings.subject_models,
                                        settings::load_shipped_marker_sets());
}

bool is_replay(const settings::DaemonSettings& settings) {
  return std::ranges::all_of(settings.cameras,
                             [](const cameras::CameraSettings& camera) { return facts_of(camera).recorded_time; });
}

Result<Assembly> assemble(const settings::DaemonSettings& settings, AuditTrail* audit) {
  Assembly made;
  made.parts.audit = audit;
  made.settings = settings.pipeline;
  made.settings.lossless = is_replay(settings);
  made.shared = std::make_unique<SharedByCameras>();
  made.shared->epoch = host_now() + kReadyWithin;
  if (!settings.ptp.socket.empty()) made.shared->ptp = cameras::make_pmc_clock(settings.ptp);
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    Result<runtime::CameraParts> camera = assemble_camera(settings, CameraId{i}, *made.shared);
    if (!camera) return camera.error();
    made.parts.cameras.push_back(std::move(*camera));
  }
  log_usb_loads(settings);
  made.parts.fusion = assemble_fusion(settings);
  made.parts.description = describe(settings, session_id(made.settings.lossless));
  if (!settings.subject_models.empty()) made.parts.explainer = assemble_explainer(settings);

  Result<std::unique_ptr<Publisher>> publisher = open_publisher(settings, audit);
  if (!publisher) return publisher.error();
  made.parts.publisher = std::move(*publisher);
  Result<std::unique_ptr<ControlServer>> control = open_control(settings, audit);
  if (!control) return control.error();
  made.parts.control = std::move(*control);
  if (Status opened = open_snapshots(settings, made.parts.description, made.parts.writers); !opened) {
    return opened.error();
  }
  Result<std::unique_ptr<BlobWriter>> blobs = open_blobs(settings);
  if (!blobs) return blobs.error();
  made.parts.blob_writer = std::move(*blobs);
  made.parts.calibrator = make_calibrator(settings);
  made.parts.preview_encoder = std::make_unique<cameras::JpegEncoder>();
  made.parts.takes = make_takes(settings, made.parts.description);
  Result<std::unique_ptr<runtime::TriggerParts>> trigger = open_trigger(settings);
  if (!trigger) return trigger.error();
  made.parts.trigger = std::move(*trigger);
  made.parts.timecode = make_timecode(settings);
  Result<std::unique_ptr<NodeServer>> node = open_node(settings, made.shared->ptp.get(), audit);
  if (!node) return node.error();
  made.parts.node = std::move(*node);
  if (has_clocks_of_nodes(settings)) made.parts.ptp = made.shared->ptp.get();
  if (!settings.kept.empty()) made.parts.writers.push_back(settings::make_subject_keeper(settings.kept));
  return made;
}

Status check_ports(const settings::DaemonSettings& before, const settings::DaemonSettings& now) {
  if (const Status free = wire::try_endpoints(endpoints_of(now), endpoints_of(before)); !free) return free;
  if (!records_takes(now) || same_trigger(before, now)) return {};
  return trigger::try_udp_ports(now.trigger, records_takes(before) ? before.trigger : trigger::TriggerSettings{});
}

Handover handover_between(const settings::DaemonSettings& before, const settings::DaemonSettings& now) {
  Handover handover;
  for (std::uint32_t i = 0; i < now.subjects.size(); ++i) {
    handover.subjects.push_back(settings::same_subject(before, now, SubjectId{i}));
  }
  const bool same_tracks = settings::same_section(before, now, "track");
  for (std::uint32_t i = 0; i < now.cameras.size(); ++i) {
    const bool continues = same_tracks && step_of(before, now, CameraId{i}) != runtime::CameraStep::Replace;
    handover.cameras.push_back(continues ? CameraId{i} : CameraId{});
  }
  const bool same_rig = settings::same_rig(before.rig, now.rig);
  handover.poses = settings::same_world(before.rig, now.rig);
  handover.matching =
      same_rig && settings::same_section(before, now, "match") && settings::same_section(before, now, "triangulate");
  handover.drift = same_rig && settings::same_section(before, now, "watch");
  return handover;
}

Result<runtime::PipelineChange> assemble_change(const settings::DaemonSettings& before,
                                                const settings::DaemonSettings& now, const runtime::Pipeline& pipeline,
                                                SharedByCameras& shared, AuditTrail* audit) {
  runtime::PipelineChange change;
  change.settings = now.pipeline;
  change.settings.lossless = is_replay(now);
  change.handover = handover_between(before, now);
  for (std::uint32_t i = 0; i < now.cameras.size(); ++i) {
    Result<runtime::CameraChange> camera = assemble_camera_change(before, now, CameraId{i}, shared);
    if (!camera) return camera.error();
    change.cameras.push_back(std::move(*camera));
  }
  log_usb_loads(now);
  change.fusion = assemble_fusion(now);
  change.description = describe(now, session_id(change.settings.lossless));
  if (!now.subject_models.empty()) change.explainer = assemble_explainer(now);
  if (!settings::same_feed(before, now)) change.open_publisher = [&now, audit] { return open_publisher(now, audit); };
  if (!settings::same_control(before, now)) change.open_control = [&now, audit] { return open_control(now, audit); };
  if (!same_trigger(before, now)) change.open_trigger = [&now] { return open_trigger(now); };

  change.snapshots_continue = before.record.snapshots == now.record.snapshots && pipeline.records_snapshots();
  if (!change.snapshots_continue) {
    if (Status opened = open_snapshots(now, change.description, change.writers); !opened) return opened.error();
  }
  change.blobs_continue = before.record.blobs == now.record.blobs && pipeline.records_blobs() &&
                          std::ranges::equal(recorded_cameras(before), recorded_cameras(now), same_recorded);
  if (!change.blobs_continue) {
    Result<std::unique_ptr<BlobWriter>> blobs = open_blobs(now);
    if (!blobs) return blobs.error();
    change.blob_writer = std::move(*blobs);
  }
  change.takes_continue = before.takes == now.takes && records_takes(before) && records_takes(now);
  if (change.takes_continue) {
    change.take_files = take_files(now);
  } else {
    change.takes = make_takes(now, change.description);
  }
  change.timecode_continues =
      settings::same_section(before, now, "timecode") && before.nominal_rate_hz == now.nominal_rate_hz;
  if (!change.timecode_continues) change.timecode = make_timecode(now);
  if (has_clocks_of_nodes(now)) change.ptp = shared.ptp.get();
  change.calibrator = make_calibrator(now);
  if (!now.kept.empty()) change.writers.push_back(settings::make_subject_keeper(now.kept));
  return change;
}

}  // namespace mocap
