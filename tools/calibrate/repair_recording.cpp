#include "calibrate/repair_recording.h"

#include <algorithm>
#include <utility>

#include "calibrate/marker_pipeline.h"

namespace mocap::calibrate {
namespace {

using calibration::CameraDeviation;
using calibration::TriangulatedMarker;
using calibration::TriangulatedSet;

constexpr std::uint32_t kMinCameras = 3;

std::vector<CameraDeviation> deviations_of(const std::vector<drift::CameraDrift>& drifts) {
  std::vector<CameraDeviation> deviations;
  for (const drift::CameraDrift& drift : drifts)
    deviations.push_back({drift.drifted, drift.off_px, drift.camera_from_world});
  return deviations;
}

/// A blob recording, triangulated by the daemon's pipeline. The recording must outlive it.
class PipelineRecording final : public calibration::MarkerRecording {
 public:
  PipelineRecording(const take::BlobRecording& recording, double drift_px)
      : recording_(recording), instants_(instants_of(recording)), drift_px_(drift_px) {}

  void triangulate(const Rig& rig, const std::vector<bool>& excluded,
                   const std::function<void(const TriangulatedSet&)>& visit) const override {
    run_pipeline(recording_, rig, excluded, [&](const PipelineOutput& output) {
      TriangulatedSet set;
      set.exposed_at = output.frames.exposed_at;
      for (const Marker& marker : output.markers) {
        if (marker.cameras < kMinCameras) continue;
        TriangulatedMarker& triangulated = set.markers.emplace_back();
        triangulated.position = marker.position;
        for (const BlobRef& ref : output.matches.matches[marker.match].sightings) {
          const BlobFrame& view = *output.frames.views[ref.view];
          triangulated.views.push_back({view.camera, view.blobs[ref.blob]});
        }
      }
      visit(set);
    });
  }

  std::span<const Blob> blobs(CameraId camera, Timestamp exposed_at) const override {
    const auto instant = std::ranges::lower_bound(instants_, exposed_at, {}, &calibration::Instant::at);
    if (instant == instants_.end() || instant->at != exposed_at || instant->image[camera.value] < 0) return {};
    const auto image = static_cast<std::size_t>(instant->image[camera.value]);
    const std::vector<Blob>& blobs = recording_.pictures[camera.value][image].blobs;
    return std::span(blobs).first(std::min(blobs.size(), kMaxBlobs));
  }

  std::vector<CameraDeviation> deviations(const Rig& rig) const override {
    return deviations_of(measure_deviations(recording_, rig, drift_px_).drifts);
  }

 private:
  const take::BlobRecording& recording_;
  std::vector<calibration::Instant> instants_;
  double drift_px_;
};

}  // namespace

Result<RecordingRepair, Failure> repair_from_recording(const take::BlobRecording& recording, const Rig& before,
                                                       const RepairSettings& settings) {
  RigDeviations deviations = measure_deviations(recording, before, settings.drift_px);
  const take::BlobRecording used = deviations.bump ? since(recording, deviations.bump->at) : recording;
  auto repaired = calibration::repair_rig(PipelineRecording(used, settings.drift_px), before,
                                          deviations_of(deviations.drifts), settings.threads);
  if (!repaired) return Failure{kExitData, repaired.error().message};
  return RecordingRepair{std::move(repaired->rig), std::move(repaired->cameras), std::move(repaired->kept),
                         deviations.bump,          repaired->before_px,          repaired->after_px};
}

}  // namespace mocap::calibrate
