#include "calibrate/mend_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/exit_codes.h"
#include "calibrate/marker_row.h"
#include "calibration/median.h"
#include "calibration/rig/refine_rig.h"
#include "geometry/lens.h"

namespace mocap::calibrate {
namespace {

constexpr std::size_t kMostSights = 4000;
constexpr std::size_t kMostMarkers = 4000;
constexpr std::size_t kLeastSights = 100;

Failure refused(std::string message) { return {kExitData, std::move(message)}; }

// The one blob within `gate_px` of a place, and none nearly as near.
const Blob* only_blob(const Blobs& blobs, const Eigen::Vector2d& at, double gate_px) {
  const Blob* best = nullptr;
  double nearest = gate_px;
  double second = 1e9;
  for (const Blob& blob : blobs) {
    const double off = (blob.centroid.v - at).norm();
    if (off < nearest) {
      second = best != nullptr ? nearest : second;
      nearest = off;
      best = &blob;
    } else {
      second = std::min(second, off);
    }
  }
  if (best == nullptr || best->merged || best->touches_border) return nullptr;
  return second < 2.0 * gate_px ? nullptr : best;
}

/// What the cameras without those that drifted say of where markers were, and what one of these saw there.
std::vector<calibration::KnownSight> sights_of(const take::BlobRecording& recording, const Rig& rig,
                                               const std::vector<bool>& without, std::uint32_t camera, double gate_px) {
  std::vector<calibration::KnownSight> sights;
  std::vector<take::RecordedPicture> const& pictures = recording.pictures[camera];
  std::size_t next = 0;
  Blobs blobs;
  run_row(recording, rig, without, [&](const RowLook& look) {
    constexpr Duration kSkew = std::chrono::milliseconds(5);
    while (next < pictures.size() && pictures[next].exposed_at < look.frames.exposed_at - kSkew) ++next;
    if (next == pictures.size() || pictures[next].exposed_at > look.frames.exposed_at + kSkew) return;
    blobs.clear();
    for (const Blob& blob : pictures[next].blobs) {
      if (!blobs.try_push_back(blob)) break;
    }
    for (const Marker& marker : look.markers) {
      if (marker.cameras < 3) continue;
      const auto at = geometry::project(rig[camera], marker.position);
      if (!at || !geometry::in_image(rig[camera], *at)) continue;
      if (const Blob* blob = only_blob(blobs, at->v, gate_px))
        sights.push_back({marker.position, blob->centroid, blob->sigma_px});
    }
  });
  if (sights.size() <= kMostSights) return sights;
  std::vector<calibration::KnownSight> some;
  for (std::size_t i = 0; i < kMostSights; ++i) some.push_back(sights[i * sights.size() / kMostSights]);
  return some;
}

/// Puts a camera where the others, `without` some, see it stand.
Result<MendedCamera, Failure> mend_one(const take::BlobRecording& recording, const CameraFromWorld& about,
                                       const std::vector<bool>& without, std::uint32_t c, Rig& rig) {
  const CameraModel before = rig[c];
  rig[c].camera_from_world = about;
  for (const double gate_px : {6.0, 2.0}) {
    const auto sights = sights_of(recording, rig, without, c, gate_px);
    const auto placed = sights.size() < kLeastSights ? std::nullopt : calibration::place_camera(rig[c], sights);
    if (!placed) {
      return refused(
          fmt::format("camera '{}' was moved, and only {} views of markers that three others see tell where "
                      "to, expected {} at least; move markers where it and others look",
                      rig[c].name, sights.size(), kLeastSights));
    }
    rig[c] = placed->camera;
  }
  const Eigen::AngleAxisd turned(
      Eigen::Matrix3d(rig[c].camera_from_world.rotation * before.camera_from_world.rotation.transpose()));
  return MendedCamera{rig[c].name, std::abs(turned.angle()), (rig[c].centre().v - before.centre().v).norm()};
}

// Enough to do without all that drifted at once, and to tell by themselves which they are.
constexpr std::ptrdiff_t kLeastLeft = 4;

// How far the others are from agreeing where markers are when they do without a camera, px: the median.
double disagreement(const take::BlobRecording& recording, const Rig& rig, std::size_t without_camera) {
  std::vector<bool> without(rig.size(), false);
  without[without_camera] = true;
  std::vector<double> off_px;
  run_row(recording, rig, without, [&](const RowLook& look) {
    for (const Marker& marker : look.markers) {
      if (marker.cameras < 3) continue;
      for (const BlobRef& ref : look.matches.matches[marker.match].sightings) {
        const BlobFrame& view = *look.frames.views[ref.view];
        const auto at = geometry::project(rig[view.camera.value], marker.position);
        if (at) off_px.push_back((view.blobs[ref.blob].centroid.v - at->v).norm());
      }
    }
  });
  return off_px.size() < kLeastSights ? std::numeric_limits<double>::infinity() : calibration::median(off_px);
}

// Where there are few cameras, one that was bumped makes others look wrong: it is the one without which they agree.
std::uint32_t one_to_blame(const take::BlobRecording& recording, const Rig& rig) {
  std::uint32_t blamed = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t c = 0; c < rig.size(); ++c) {
    const double off_px = disagreement(recording, rig, c);
    if (off_px >= least) continue;
    least = off_px;
    blamed = c;
  }
  return blamed;
}

/// Puts cameras that drifted where the others see them stand, one after the other, and looks at all anew.
std::optional<Failure> mend(const take::BlobRecording& recording, std::vector<drift::CameraDrift> drifts,
                            double drift_px, Rig& rig, std::vector<MendedCamera>& mended) {
  for (;;) {
    const auto drifted = std::ranges::count_if(drifts, &drift::CameraDrift::drifted);
    if (drifted == 0) return std::nullopt;
    if (2 * (mended.size() + 1) > rig.size()) {
      return refused(
          fmt::format("more than {} of {} cameras stand otherwise than the rig says: too many to be mended from the "
                      "others; calibrate anew with mocap-calibrate wand",
                      mended.size(), rig.size()));
    }
    const bool many = static_cast<std::ptrdiff_t>(rig.size()) - drifted >= kLeastLeft;
    const auto worst = std::ranges::max_element(
        drifts, {}, [](const drift::CameraDrift& drift) { return drift.drifted ? drift.off_px : -1.0; });
    const auto c = many ? static_cast<std::uint32_t>(worst - drifts.begin()) : one_to_blame(recording, rig);
    std::vector<bool> without(rig.size(), false);
    for (std::size_t i = 0; i < rig.size(); ++i) without[i] = i == c || (many && drifts[i].drifted);
    const CameraFromWorld about = drifts[c].drifted ? drifts[c].camera_from_world : rig[c].camera_from_world;
    auto one = mend_one(recording, about, without, c, rig);
    if (!one) return one.error();
    mended.push_back(*std::move(one));
    drifts = standing_of(recording, rig, drift_px).drifts;
  }
}

std::vector<calibration::SeenMarker> seen_markers(const take::BlobRecording& recording, const Rig& rig) {
  std::vector<calibration::SeenMarker> all;
  run_row(recording, rig, {}, [&](const RowLook& look) {
    for (const Marker& marker : look.markers) {
      if (marker.cameras < 3) continue;
      calibration::SeenMarker& seen = all.emplace_back();
      seen.point = marker.position;
      for (const BlobRef& ref : look.matches.matches[marker.match].sightings) {
        const BlobFrame& view = *look.frames.views[ref.view];
        const Blob& blob = view.blobs[ref.blob];
        if (blob.merged || blob.touches_border) continue;
        seen.sights.push_back({static_cast<int>(view.camera.value), blob.centroid, blob.sigma_px});
      }
      if (seen.sights.size() < 3) all.pop_back();
    }
  });
  if (all.size() <= kMostMarkers) return all;
  std::vector<calibration::SeenMarker> some;
  for (std::size_t i = 0; i < kMostMarkers; ++i) some.push_back(std::move(all[i * all.size() / kMostMarkers]));
  return some;
}

}  // namespace

Result<MendedRig, Failure> mend_rig(const take::BlobRecording& whole, const Rig& before, const MendSettings& wanted) {
  Standing standing = standing_of(whole, before, wanted.drift_px);
  const take::BlobRecording recording = standing.moved ? since(whole, standing.moved->at) : whole;
  MendedRig mended;
  mended.moved = std::move(standing.moved);
  Rig rig = before;
  if (auto failed = mend(recording, std::move(standing.drifts), wanted.drift_px, rig, mended.cameras)) return *failed;
  calibration::RefineRigSettings settings;
  settings.threads = wanted.threads;
  const auto markers = seen_markers(recording, rig);
  auto refined = calibration::refine_rig(rig, markers, settings);
  if (!refined) {
    return refused(
        fmt::format("{} markers that three cameras or more saw, expected 50 at least; move some through the "
                    "whole volume, longer",
                    markers.size()));
  }
  const auto after = standing_of(recording, refined->rig, wanted.drift_px).drifts;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (after[c].drifted) {
      return refused(
          fmt::format("camera '{}' is still {:.2f} px off: no turn and move of it explains what it sees; has "
                      "its lens been touched? Calibrate anew with mocap-calibrate wand",
                      rig[c].name, after[c].off_px));
    }
  }
  mended.rig = std::move(refined->rig);
  mended.before_px = refined->before_px;
  mended.after_px = refined->after_px;
  return mended;
}

}  // namespace mocap::calibrate
