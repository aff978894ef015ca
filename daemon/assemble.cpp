#include "assemble.h"

#include <fmt/format.h>

#include <algorithm>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "base/log.h"
#include "cameras/aravis/usb_bandwidth.h"
#include "cameras/open_camera.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "detect/blob_detector.h"
#include "label/body_labeller.h"
#include "settings/subject_keeper.h"
#include "solve/subject_refiner.h"
#include "solve/tree_solver.h"
#include "take/blob_recording.h"
#include "take/snapshot_writer.h"
#include "track2d/following_blob_tracker.h"
#include "track3d/kalman_marker_tracker.h"
#include "wire/zmq_control.h"
#include "wire/zmq_publisher.h"

namespace mocap {
namespace {

// From the making of the cameras to the first simulated exposure: all of them stand ready by then.
constexpr Duration kReadyWithin = std::chrono::milliseconds(200);

// Simulated cameras that keep to the clock see one world: its motion begins at one instant for all of them, and they
// expose together. What has an epoch keeps it.
cameras::CameraSettings in_step(cameras::CameraSettings camera, Timestamp epoch) {
  auto* synthetic = camera.driver.as<cameras::SyntheticSettings>();
  if (synthetic != nullptr && synthetic->speed > 0.0 && synthetic->epoch == Timestamp{}) synthetic->epoch = epoch;
  return camera;
}

// Of this run: lets a client see that the daemon was started anew. A replay's is fixed, so that its output is.
std::string session_id(bool replay) {
  if (replay) return "replay";
  std::random_device entropy;
  return fmt::format("{:08x}{:08x}", entropy(), entropy());
}

Description describe(const settings::DaemonSettings& settings, bool replay) {
  Description description;
  description.producer = "mocapd " MOCAP_VERSION;
  description.session_id = session_id(replay);
  description.nominal_rate_hz = settings.nominal_rate_hz;
  description.cameras = settings.rig;
  description.subjects = settings.subject_models;
  return description;
}

std::vector<MaskPolygon> masks_of(const CameraModel& camera) {
  std::vector<MaskPolygon> all = camera.masks;
  all.insert(all.end(), camera.learnt_masks.begin(), camera.learnt_masks.end());
  return all;
}

// What the cameras that are plugged in by now ask of their USB.
void tell_usb_loads(const settings::DaemonSettings& settings) {
  for (const cameras::UsbLoad& load : cameras::usb_loads(settings.cameras, settings.rig)) {
    if (load.too_much()) {
      log_warn("cameras", load.text() + "; plug a camera into another controller or a faster port, or lower rate_hz");
    } else {
      log_info("cameras", load.text());
    }
  }
}

}  // namespace

fusion::FusionParts assemble_row(const settings::DaemonSettings& settings) {
  fusion::FusionParts row;
  row.matcher = associate::make_matcher(settings.match, settings.rig);
  row.triangulator = associate::make_triangulator(settings.triangulate, settings.rig);
  row.tracker = track3d::make_marker_tracker(settings.track_markers);
  row.labeller = label::make_labeller(settings.label, settings.subject_models);
  row.solver = solve::make_skeleton_solver(settings.solve, settings.subject_models);
  if (settings.refine.instants > 0) {
    row.refiner = std::make_unique<solve::SubjectRefiner>(settings.refine, settings.subject_models);
  }
  if (settings.drift.drift_px > 0.0) row.drift = std::make_unique<drift::DriftWatch>(settings.drift, settings.rig);
  return row;
}

std::unique_ptr<fusion::Fusion> assemble_fusion(const settings::DaemonSettings& settings) {
  return std::make_unique<fusion::Fusion>(assemble_row(settings), static_cast<std::uint32_t>(settings.rig.size()));
}

Result<runtime::CameraParts> assemble_camera(const settings::DaemonSettings& settings, CameraId id, Timestamp epoch) {
  const cameras::CameraSettings wanted = in_step(settings.cameras[id.value], epoch);
  const CameraModel& model = settings.rig[id.value];
  runtime::CameraParts parts;
  parts.name = wanted.name;
  parts.stream = std::make_unique<StreamCounters>();
  Result<std::unique_ptr<Camera>> camera = cameras::open_camera(
      id, wanted, {.rig = &settings.rig, .marker_set = &settings.simulated[id.value], .counters = parts.stream.get()});
  if (!camera) return camera.error();
  parts.camera = std::move(*camera);
  parts.make_detector = [detect = settings::detect_of(settings, id), masks = masks_of(model)](const Image& like) {
    return detect::make_blob_detector(detect, like.format, like.width_px, like.height_px, masks);
  };
  parts.tracker = track2d::make_blob_tracker(settings.track_blobs);
  parts.expected_width_px = model.width_px;
  parts.expected_height_px = model.height_px;
  parts.drawn_masks = model.masks;
  return parts;
}

Result<Assembly> assemble(const settings::DaemonSettings& settings) {
  Assembly made;
  made.settings = settings.pipeline;
  made.settings.lossless = std::ranges::all_of(
      settings.cameras, [](const cameras::CameraSettings& camera) { return facts_of(camera).recorded_time; });
  const Timestamp epoch = host_now() + kReadyWithin;
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    Result<runtime::CameraParts> camera = assemble_camera(settings, CameraId{i}, epoch);
    if (!camera) return camera.error();
    made.parts.cameras.push_back(std::move(*camera));
  }
  tell_usb_loads(settings);
  made.parts.fusion = assemble_fusion(settings);
  made.parts.description = describe(settings, made.settings.lossless);

  wire::PublisherSettings feed = settings.publish;
  feed.subjects = settings.subjects.size();
  Result<std::unique_ptr<Publisher>> publisher = wire::make_zmq_publisher(feed);
  if (!publisher) return publisher.error();
  made.parts.publisher = std::move(*publisher);

  if (settings.control.endpoint != "none") {
    wire::ControlSettings listening = settings.control;
    if (listening.endpoint.empty()) listening.endpoint = wire::control_beside(settings.publish.endpoint);
    Result<std::unique_ptr<wire::ZmqControl>> control = wire::ZmqControl::open(listening);
    if (!control) return control.error();
    made.parts.control = std::move(*control);
  }
  if (!settings.record.snapshots.empty()) {
    Result<std::unique_ptr<Writer>> writer = take::make_snapshot_writer(settings.record.snapshots);
    if (!writer) return writer.error();
    made.parts.writers.push_back(std::move(*writer));
  }
  if (!settings.record.blobs.empty()) {
    std::vector<take::RecordedCamera> cameras;
    for (const CameraModel& camera : settings.rig) cameras.push_back({camera.name, camera.width_px, camera.height_px});
    Result<std::unique_ptr<BlobWriter>> writer = take::make_blob_writer(settings.record.blobs, cameras);
    if (!writer) return writer.error();
    made.parts.blob_writer = std::move(*writer);
  }
  if (!settings.kept.empty()) made.parts.writers.push_back(settings::make_subject_keeper(settings.kept));
  return made;
}

}  // namespace mocap
