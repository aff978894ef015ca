#include "calibrate/marker_pipeline.h"

#include <algorithm>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "calibrate/gather_blobs.h"
#include "calibration/floor/stationary_markers.h"
#include "calibration/floor/walk_positions.h"
#include "model/identity_map.h"
#include "track3d/kalman_marker_tracker.h"

namespace mocap::calibrate {
namespace {

constexpr double kUnbounded_m = 1000.0;

}  // namespace

std::vector<calibration::Instant> instants_of(const take::BlobRecording& recording) {
  calibration::Take times;  // exposure times without blobs: group_by_instant needs no more
  for (const auto& pictures : recording.pictures) {
    auto& camera = times.cameras.emplace_back();
    for (const auto& image : pictures) camera.push_back({image.exposed_at, {}});
  }
  return calibration::group_by_instant(times, calibration::kMaxSkew);
}

void run_pipeline(const take::BlobRecording& recording, const Rig& rig, const std::vector<bool>& excluded,
                  const std::function<void(const PipelineOutput&)>& visit) {
  associate::MatchSettings match;
  match.volume_min_m.setConstant(-kUnbounded_m);
  match.volume_max_m.setConstant(kUnbounded_m);
  const auto matcher = associate::make_matcher(match, rig);
  const auto triangulator = associate::make_triangulator({}, rig);
  const auto tracker = track3d::make_marker_tracker({});
  std::vector<BlobFrame> views(rig.size());
  const auto identities = std::make_unique<IdentityMap>(rig.size());
  FrameSet frames;
  for (const calibration::Instant& instant : instants_of(recording)) {
    frames.views.clear();
    for (std::uint32_t c = 0; c < rig.size(); ++c) {
      if (instant.image[c] < 0 || (!excluded.empty() && excluded[c])) continue;
      const take::RecordedPicture& image = recording.pictures[c][static_cast<std::size_t>(instant.image[c])];
      BlobFrame& view = views[c];
      view.camera = CameraId{c};
      view.number = image.number;
      view.exposed_at = image.exposed_at;
      view.blobs.clear();
      for (const Blob& blob : image.blobs) {
        if (!view.blobs.try_push_back(blob)) break;
      }
      frames.views.push_back(&view);
    }
    if (frames.views.empty()) continue;
    ++frames.number;
    frames.exposed_at = instant.at;
    frames.expected_views = static_cast<std::uint32_t>(rig.size());
    const Predictions& predicted = identities->predict(frames, tracker->predict(instant.at), {});
    const Matches& matches = matcher->match(frames, predicted);
    const Markers& markers = triangulator->triangulate(frames, matches);
    visit({frames, matches, markers, tracker->step(markers, predicted, matches.bearing_only)});
    identities->update(frames, matches, {});
  }
}

std::vector<Eigen::Vector3d> stationary_markers(const take::BlobRecording& recording, const Rig& rig) {
  calibration::StationaryMarkers stationary;
  run_pipeline(recording, rig, {}, [&](const PipelineOutput& output) {
    stationary.begin(output.frames.exposed_at);
    for (const TrackedMarker& marker : output.tracked) {
      if (marker.state == TrackState::Confirmed) stationary.add(marker.id, marker.position.v);
    }
  });
  return stationary.positions();
}

std::vector<Eigen::Vector3d> walk_positions(const take::BlobRecording& recording, const Rig& rig) {
  calibration::WalkPositions walk;
  run_pipeline(recording, rig, {}, [&](const PipelineOutput& output) {
    for (const Marker& marker : output.markers) walk.add(marker.position.v, marker.cameras);
  });
  return walk.positions();
}

}  // namespace mocap::calibrate
