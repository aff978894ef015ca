#include "assemble_camera.h"

#include <memory>
#include <utility>
#include <vector>

#include "cameras/node/node_camera.h"
#include "cameras/open_camera.h"
#include "cameras/replay/replay_settings.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "detect/blob_detector.h"
#include "detect/delivered_blobs.h"
#include "model/calibration/calibrated_camera.h"
#include "settings/same_settings.h"
#include "take/take_camera.h"
#include "track2d/following_blob_tracker.h"

namespace mocap {
namespace {

// Gives all simulated cameras that run in real time the same epoch, so that they show one motion and expose together. A
// configured epoch is kept.
cameras::CameraSettings in_step(cameras::CameraSettings camera, Timestamp epoch) {
  auto* synthetic = camera.driver.as<cameras::SyntheticSettings>();
  if (synthetic != nullptr && synthetic->speed > 0.0 && synthetic->epoch == Timestamp{}) synthetic->epoch = epoch;
  return camera;
}

std::vector<MaskPolygon> masks_of(const CameraModel& camera) {
  std::vector<MaskPolygon> all = camera.masks;
  all.insert(all.end(), camera.learnt_masks.begin(), camera.learnt_masks.end());
  return all;
}

bool plays_take(const cameras::CameraSettings& camera) {
  const auto* replay = camera.driver.as<cameras::ReplaySettings>();
  return replay != nullptr && !replay->file.empty();
}

void deliver_blobs(std::unique_ptr<BlobCamera> camera, runtime::CameraParts& into) {
  into.make_detector = [camera = camera.get()](const Image&) { return detect::make_delivered_detector(*camera); };
  into.tracker = detect::make_delivered_tracker();
  into.camera = std::move(camera);
}

bool is_on_node(const cameras::CameraSettings& camera) {
  return camera.driver.as<cameras::NodeCameraSettings>() != nullptr;
}

// Opens the camera with its detector and its 2D tracker.
Status open_camera(const settings::DaemonSettings& settings, CameraId id, SharedByCameras& shared,
                   runtime::CameraParts& into) {
  const cameras::CameraSettings wanted = in_step(settings.cameras[id.value], shared.epoch);
  if (plays_take(wanted)) {
    const auto* replay = wanted.driver.as<cameras::ReplaySettings>();
    auto camera = take::make_take_camera(id, wanted.name, {replay->file, replay->speed, replay->loop});
    deliver_blobs(std::move(camera), into);
    return {};
  }
  if (const auto* node = wanted.driver.as<cameras::NodeCameraSettings>()) {
    Result<std::unique_ptr<BlobCamera>> camera = cameras::make_node_camera(id, wanted.name, *node,
                                                                           {.counters = into.stream.get(),
                                                                            .window = settings.pipeline.align.window,
                                                                            .node_clocks = &shared.node_clocks,
                                                                            .ptp = shared.ptp.get()});
    if (!camera) return camera.error();
    deliver_blobs(std::move(*camera), into);
    into.failures = &shared.node_failures;
    return {};
  }
  Result<std::unique_ptr<Camera>> camera = cameras::open_camera(
      id, wanted, {.rig = &settings.rig, .marker_set = &settings.simulated[id.value], .counters = into.stream.get()});
  if (!camera) return camera.error();
  into.camera = std::move(*camera);
  into.make_detector = [detect = settings::detect_of(settings, id),
                        masks = masks_of(settings.rig[id.value])](const Image& like) {
    return detect::make_blob_detector(detect, like.format, like.width_px, like.height_px, masks);
  };
  into.tracker = track2d::make_blob_tracker(settings.track_blobs);
  return {};
}

}  // namespace

bool delivers_blobs(const cameras::CameraSettings& camera) { return plays_take(camera) || is_on_node(camera); }

Result<runtime::CameraParts> assemble_camera(const settings::DaemonSettings& settings, CameraId id,
                                             SharedByCameras& shared) {
  const CameraModel& model = settings.rig[id.value];
  runtime::CameraParts parts;
  parts.name = settings.cameras[id.value].name;
  parts.stream = std::make_unique<StreamCounters>();
  if (const Status opened = open_camera(settings, id, shared, parts); !opened) return opened.error();
  if (is_calibrated(model)) {
    parts.expected_width_px = model.width_px;
    parts.expected_height_px = model.height_px;
  }
  parts.drawn_masks = model.masks;
  parts.recorded = facts_of(settings.cameras[id.value]).recorded_time;
  return parts;
}

runtime::CameraStep step_of(const settings::DaemonSettings& before, const settings::DaemonSettings& now, CameraId id) {
  if (!settings::same_device(before, now, id)) return runtime::CameraStep::Replace;
  if (before.pipeline.camera_queue_frames != now.pipeline.camera_queue_frames) return runtime::CameraStep::Replace;
  // A camera of a node compares the uncertainty of the node's clock with the window.
  const bool same_window = before.pipeline.align.window == now.pipeline.align.window;
  if (!same_window && is_on_node(now.cameras[id.value])) return runtime::CameraStep::Replace;
  if (settings::same_processing(before, now, id)) return runtime::CameraStep::Continue;
  // The detector of delivered blobs belongs to its camera.
  return delivers_blobs(now.cameras[id.value]) ? runtime::CameraStep::Replace : runtime::CameraStep::Refresh;
}

Result<runtime::CameraChange> assemble_camera_change(const settings::DaemonSettings& before,
                                                     const settings::DaemonSettings& now, CameraId id,
                                                     SharedByCameras& shared) {
  runtime::CameraChange change;
  change.step = step_of(before, now, id);
  if (change.step == runtime::CameraStep::Continue) return change;
  Result<runtime::CameraParts> parts = assemble_camera(now, id, shared);
  if (!parts) return parts.error();
  change.parts = std::move(*parts);
  if (change.step == runtime::CameraStep::Replace) return change;
  change.parts.camera.reset();
  if (settings::same_section(before, now, "track")) change.parts.tracker.reset();
  return change;
}

}  // namespace mocap
