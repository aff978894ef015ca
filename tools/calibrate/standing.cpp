#include "calibrate/standing.h"

#include <algorithm>

#include "calibrate/marker_row.h"

namespace mocap::calibrate {
namespace {

// Of markers in views, weighted: fewer do not tell how a camera stands.
constexpr double kLeastViews = 100.0;
// A camera that stood as the rig says was off by so much less than what is told of.
constexpr double kStoodRight = 0.5;
// What comes after a bump must be so long to count alone.
constexpr double kLeastAfter_s = 2.0;

// The first and the last picture of all.
std::pair<Timestamp, Timestamp> span_of(const take::BlobRecording& recording) {
  std::pair<Timestamp, Timestamp> span{Timestamp::max(), Timestamp::min()};
  for (const auto& pictures : recording.pictures) {
    if (pictures.empty()) continue;
    span.first = std::min(span.first, pictures.front().exposed_at);
    span.second = std::max(span.second, pictures.back().exposed_at);
  }
  return span;
}

// As the daemon watches; tells the last camera that stood as the rig says, and then did not.
Standing watched(const take::BlobRecording& recording, const Rig& rig, const drift::DriftSettings& settings) {
  const auto [begin, end] = span_of(recording);
  Standing standing;
  std::vector<bool> stood(rig.size(), false);
  drift::DriftWatch watch(settings, rig);
  run_row(recording, rig, {}, [&, first = begin, last = end](const RowLook& look) {
    const CameraId camera = watch.update(look.frames, look.matches, look.markers);
    const drift::CameraDrift& drift = watch.camera(camera);
    if (drift.views < kLeastViews) return;
    if (drift.off_px < kStoodRight * settings.drift_px) stood[camera.value] = true;
    if (!drift.drifted || !stood[camera.value]) return;
    stood[camera.value] = false;
    if (to_s(last - look.frames.exposed_at) < kLeastAfter_s) return;
    standing.moved = {camera.value, look.frames.exposed_at, to_s(look.frames.exposed_at - first)};
  });
  for (std::uint32_t c = 0; c < rig.size(); ++c) standing.drifts.push_back(watch.camera(CameraId{c}));
  return standing;
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

Standing standing_of(const take::BlobRecording& recording, const Rig& rig, double drift_px) {
  drift::DriftSettings settings;
  settings.drift_px = drift_px;
  Standing standing = watched(recording, rig, settings);
  // Who saw it happen knows which camera it was; else the whole take counts.
  if (standing.moved) return standing;
  settings.memory_s = 1e6;
  return watched(recording, rig, settings);
}

}  // namespace mocap::calibrate
