#include "calibrate/rig_deviations.h"

#include <algorithm>

#include "calibrate/marker_pipeline.h"
#include "calibration/image_cells.h"

namespace mocap::calibrate {
namespace {

// A bump is a transition from below this fraction of the drift threshold to above the threshold. Chosen by hand.
constexpr double kUndriftedFraction = 0.5;
// A bump nearer to the end of the recording is ignored: the rest would be too short. Chosen by hand.
constexpr double kMinTimeAfterBump_s = 2.0;
// Memory of the drift watch that lets all views of a recording count equally.
constexpr double kNoForgetting_s = 1e6;

// Exposure times of the first and the last image.
std::pair<Timestamp, Timestamp> span_of(const take::BlobRecording& recording) {
  std::pair<Timestamp, Timestamp> span{Timestamp::max(), Timestamp::min()};
  for (const auto& pictures : recording.pictures) {
    if (pictures.empty()) continue;
    span.first = std::min(span.first, pictures.front().exposed_at);
    span.second = std::max(span.second, pictures.back().exposed_at);
  }
  return span;
}

// With fewer cameras a matched view says nothing: the marker was fitted to it. The drift watch also uses unmatched
// blobs at markers of three other cameras; they are not counted here.
constexpr std::uint32_t kMinCamerasOfView = 4;

void cover(const PipelineOutput& output, const Rig& rig, std::vector<calibration::CoveredCells>& covered) {
  for (const Marker& marker : output.markers) {
    if (marker.cameras < kMinCamerasOfView) continue;
    for (const BlobRef& ref : output.matches.matches[marker.match].sightings) {
      const BlobFrame& view = *output.frames.views[ref.view];
      const CameraModel& camera = rig[view.camera.value];
      covered[view.camera.value].set(
          calibration::cell_of(view.blobs[ref.blob].centroid.v, camera.width_px, camera.height_px));
    }
  }
}

// Runs the daemon's drift watch and records the last bump.
RigDeviations run_watch(const take::BlobRecording& recording, const Rig& rig, const drift::DriftSettings& settings) {
  const auto [begin, end] = span_of(recording);
  RigDeviations deviations;
  std::vector<bool> undrifted(rig.size(), false);
  std::vector<calibration::CoveredCells> covered(rig.size());
  drift::DriftWatch watch(settings, rig);
  run_pipeline(recording, rig, {}, [&, first = begin, last = end](const PipelineOutput& output) {
    cover(output, rig, covered);
    const CameraId camera = watch.update(output.frames, output.matches, output.markers);
    const drift::CameraDrift& drift = watch.camera(camera);
    if (drift.views < kMinViews) return;
    if (drift.off_px < kUndriftedFraction * settings.drift_px) undrifted[camera.value] = true;
    if (!drift.drifted || !undrifted[camera.value]) return;
    undrifted[camera.value] = false;
    if (to_s(last - output.frames.exposed_at) < kMinTimeAfterBump_s) return;
    covered.assign(rig.size(), {});
    deviations.bump = {camera.value, output.frames.exposed_at, to_s(output.frames.exposed_at - first)};
  });
  for (std::uint32_t c = 0; c < rig.size(); ++c) deviations.drifts.push_back(watch.camera(CameraId{c}));
  for (const calibration::CoveredCells& cells : covered) deviations.covered_cells.push_back(cells.count());
  return deviations;
}

}  // namespace

take::BlobRecording since(const take::BlobRecording& recording, Timestamp from) {
  take::BlobRecording part;
  part.cameras = recording.cameras;
  for (const auto& pictures : recording.pictures) {
    const auto first = std::ranges::lower_bound(pictures, from, {}, &take::RecordedPicture::exposed_at);
    part.pictures.emplace_back(first, pictures.end());
  }
  return part;
}

take::BlobRecording last_of(const take::BlobRecording& recording, double seconds) {
  const auto [begin, end] = span_of(recording);
  return end <= begin ? recording : since(recording, end - from_s(seconds));
}

bool is_undetermined(const RigDeviations& deviations, std::size_t camera) {
  const drift::CameraDrift& drift = deviations.drifts[camera];
  return drift.views < kMinViews ||
         (!drift.drifted && deviations.covered_cells[camera] < calibration::kMinCoveredCells);
}

RigDeviations measure_deviations(const take::BlobRecording& recording, const Rig& rig, double drift_px) {
  drift::DriftSettings settings;
  settings.drift_px = drift_px;
  RigDeviations deviations = run_watch(recording, rig, settings);
  if (deviations.bump) return deviations;
  settings.memory_s = kNoForgetting_s;
  return run_watch(recording, rig, settings);
}

}  // namespace mocap::calibrate
