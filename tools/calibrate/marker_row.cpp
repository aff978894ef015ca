#include "calibrate/marker_row.h"

#include <algorithm>
#include <map>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "calibrate/gather_blobs.h"
#include "calibration/wand/instants.h"
#include "track3d/kalman_marker_tracker.h"

namespace mocap::calibrate {
namespace {

constexpr Duration kMostSkew = std::chrono::milliseconds(5);
constexpr double kStill_m = 0.003;
constexpr std::size_t kMostPlaces = 20000;

// Only times are needed to gather instants.
calibration::Take times_of(const take::BlobRecording& recording) {
  calibration::Take take;
  for (const auto& pictures : recording.pictures) {
    auto& camera = take.cameras.emplace_back();
    for (const auto& picture : pictures) camera.push_back({picture.exposed_at, {}});
  }
  return take;
}

}  // namespace

void run_row(const take::BlobRecording& recording, const Rig& rig, const std::vector<bool>& without,
             const std::function<void(const RowLook&)>& look) {
  associate::MatchSettings match;
  match.volume_min_m.setConstant(-1000.0);
  match.volume_max_m.setConstant(1000.0);
  const auto matcher = associate::make_matcher(match, rig);
  const auto triangulator = associate::make_triangulator({}, rig);
  const auto tracker = track3d::make_marker_tracker({});
  const calibration::Take times = times_of(recording);
  std::vector<BlobFrame> views(rig.size());
  auto expected = std::make_unique<Expected>();
  FrameSet frames;
  for (const calibration::Instant& instant : calibration::gather_instants(times, kMostSkew)) {
    frames.views.clear();
    for (std::uint32_t c = 0; c < rig.size(); ++c) {
      if (instant.picture[c] < 0 || (!without.empty() && without[c])) continue;
      const take::RecordedPicture& picture = recording.pictures[c][static_cast<std::size_t>(instant.picture[c])];
      BlobFrame& view = views[c];
      view.camera = CameraId{c};
      view.number = picture.number;
      view.exposed_at = picture.exposed_at;
      view.blobs.clear();
      for (const Blob& blob : picture.blobs) {
        if (!view.blobs.try_push_back(blob)) break;
      }
      frames.views.push_back(&view);
    }
    if (frames.views.empty()) continue;
    ++frames.number;
    frames.exposed_at = instant.at;
    frames.expected_views = static_cast<std::uint32_t>(rig.size());
    expected->at = instant.at;
    expected->markers.clear();
    tracker->predict(instant.at, *expected);
    const Matches& matches = matcher->match(frames, *expected);
    const Markers& markers = triangulator->triangulate(frames, matches);
    look({frames, matches, markers, tracker->step(markers, *expected, matches.bearing_only)});
  }
}

std::vector<StillMarker> still_markers(const take::BlobRecording& recording, const Rig& rig) {
  struct Sum {
    Eigen::Vector3d first;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t sets = 0;
    Timestamp from, to;
    bool moved = false;
  };
  std::map<TrackId, Sum> tracks;
  std::size_t sets = 0;
  run_row(recording, rig, {}, [&](const RowLook& look) {
    ++sets;
    for (const TrackedMarker& marker : look.tracked) {
      if (marker.state != TrackState::Confirmed) continue;
      const Eigen::Vector3d& at = marker.position.v;
      auto [one, is_new] =
          tracks.try_emplace(marker.id, Sum{at, {0.0, 0.0, 0.0}, 0, look.frames.exposed_at, {}, false});
      Sum& sum = one->second;
      sum.moved = sum.moved || (at - sum.first).norm() > kStill_m;
      sum.sum += at;
      ++sum.sets;
      sum.to = look.frames.exposed_at;
    }
  });
  std::vector<StillMarker> still;
  for (const auto& [id, sum] : tracks) {
    if (sum.moved || 2 * sum.sets < sets || to_s(sum.to - sum.from) < 1.0) continue;
    still.push_back({sum.sum / static_cast<double>(sum.sets), sum.sets});
  }
  return still;
}

std::vector<Eigen::Vector3d> marker_places(const take::BlobRecording& recording, const Rig& rig) {
  std::vector<Eigen::Vector3d> places;
  run_row(recording, rig, {}, [&](const RowLook& look) {
    for (const Marker& marker : look.markers) {
      if (marker.cameras >= 3) places.push_back(marker.position.v);
    }
  });
  if (places.size() <= kMostPlaces) return places;
  std::vector<Eigen::Vector3d> some;
  for (std::size_t i = 0; i < kMostPlaces; ++i) some.push_back(places[i * places.size() / kMostPlaces]);
  return some;
}

}  // namespace mocap::calibrate
