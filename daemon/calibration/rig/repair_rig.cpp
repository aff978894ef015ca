#include "calibration/rig/repair_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "calibration/image_cells.h"
#include "calibration/rig/refine_rig.h"
#include "calibration/rig/resect_camera.h"
#include "calibration/robust_statistics.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// Bounds of the work: more observations and markers are thinned out evenly.
constexpr std::size_t kMaxObservations = 4000;
constexpr std::size_t kMaxMarkersUsed = 4000;
// Gates of a blob about its projected marker, before and after the first resection.
constexpr double kGates_px[] = {6.0, 2.0};
// A second blob within so many gates makes the nearest one ambiguous.
constexpr double kAmbiguityGates = 2.0;
// Four cameras triangulate from three and still confirm each other without one of them.
constexpr std::ptrdiff_t kMinUndriftedCameras = 4;
constexpr std::size_t kMinViews = 3;
constexpr double kDegree = std::numbers::pi / 180.0;
// A less certain new pose is refused: it would be no better than the bumps that mocap-eval drift plants (5 mm and 0.3
// degrees). 100 views of a volume give 0.3 to 0.4 mm and 0.006 to 0.008 degrees (resect_camera_test).
constexpr double kMaxPositionSigma_m = 0.005;
constexpr double kMaxRotationSigma_rad = 0.1 * kDegree;

Error refusal(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

template <class T>
std::vector<T> thin_out(std::vector<T> all, std::size_t max) {
  if (all.size() <= max) return all;
  std::vector<T> some;
  for (std::size_t i = 0; i < max; ++i) some.push_back(std::move(all[i * all.size() / max]));
  return some;
}

// The only blob near a position; null if there is none, a second one, or if the blob is merged or cut off.
const Blob* unambiguous_blob(std::span<const Blob> blobs, const Eigen::Vector2d& at, double gate_px) {
  const Blob* best = nullptr;
  double nearest = gate_px;
  double second = 1e9;
  for (const Blob& blob : blobs) {
    const double distance = (blob.centroid.v - at).norm();
    if (distance < nearest) {
      second = best != nullptr ? nearest : second;
      nearest = distance;
      best = &blob;
    } else {
      second = std::min(second, distance);
    }
  }
  if (best == nullptr || best->merged || best->touches_border) return nullptr;
  return second < kAmbiguityGates * gate_px ? nullptr : best;
}

// The blobs of `camera` at the markers that the cameras which are not excluded triangulate.
std::vector<PointObservation> observations_of(const MarkerRecording& recording, const Rig& rig,
                                              const std::vector<bool>& excluded, CameraId camera, double gate_px) {
  std::vector<PointObservation> observations;
  const CameraModel& model = rig[camera.value];
  recording.triangulate(rig, excluded, [&](const TriangulatedSet& set) {
    const std::span<const Blob> blobs = recording.blobs(camera, set.exposed_at);
    for (const TriangulatedMarker& marker : set.markers) {
      const auto at = geometry::project(model, marker.position);
      if (!at || !geometry::in_image(model, *at)) continue;
      if (const Blob* blob = unambiguous_blob(blobs, at->v, gate_px))
        observations.push_back({marker.position, blob->centroid, blob->sigma_px});
    }
  });
  return thin_out(std::move(observations), kMaxObservations);
}

// Refuses a new pose that its views do not determine: many views may be views of one place.
std::optional<Error> undetermined_pose(const FittedCamera& fitted) {
  const std::optional<PoseUncertainty>& sigma = fitted.uncertainty;
  if (sigma && sigma->position_m <= kMaxPositionSigma_m && sigma->rotation_rad <= kMaxRotationSigma_rad)
    return std::nullopt;
  const std::string figures = sigma ? fmt::format("only to {:.1f} mm and {:.2f} degrees", 1e3 * sigma->position_m,
                                                  sigma->rotation_rad / kDegree)
                                    : "not at all";
  return refusal(fmt::format(
      "camera '{}' was moved, and its {} views of markers determine its new pose {}, expected to {:.0f} mm "
      "and {:.1f} degrees; move markers through the image of this camera, where three other cameras see "
      "them, too",
      fitted.camera.name, fitted.used, figures, 1e3 * kMaxPositionSigma_m, kMaxRotationSigma_rad / kDegree));
}

// Replaces the pose of one camera. `initial`: a pose that is about right.
Result<RepairedCamera> repair_camera(const MarkerRecording& recording, const CameraFromWorld& initial,
                                     const std::vector<bool>& excluded, CameraId id, Rig& rig) {
  CameraModel& camera = rig[id.value];
  const CameraModel before = camera;
  camera.camera_from_world = initial;
  std::optional<FittedCamera> resected;
  for (const double gate_px : kGates_px) {
    const auto observations = observations_of(recording, rig, excluded, id, gate_px);
    resected = observations.size() < kMinRepairViews ? std::nullopt : resect_pose(camera, observations);
    if (!resected) {
      return refusal(
          fmt::format("camera '{}' was moved, and only {} views of markers that three other cameras see are left to "
                      "estimate its new pose, expected at least {}; move markers in the common view of this and other "
                      "cameras",
                      camera.name, observations.size(), kMinRepairViews));
    }
    camera = resected->camera;
  }
  if (auto error = undetermined_pose(*resected)) return *std::move(error);
  const Eigen::AngleAxisd rotation(
      Eigen::Matrix3d(camera.camera_from_world.rotation * before.camera_from_world.rotation.transpose()));
  return RepairedCamera{camera.name, std::abs(rotation.angle()), (camera.centre().v - before.centre().v).norm()};
}

// Median reprojection residual of the other cameras if one camera is excluded; infinite for too few views.
double residual_without_px(const MarkerRecording& recording, const Rig& rig, std::size_t camera) {
  std::vector<bool> excluded(rig.size(), false);
  excluded[camera] = true;
  std::vector<double> residuals_px;
  recording.triangulate(rig, excluded, [&](const TriangulatedSet& set) {
    for (const TriangulatedMarker& marker : set.markers) {
      for (const MarkerView& view : marker.views) {
        const auto at = geometry::project(rig[view.camera.value], marker.position);
        if (at) residuals_px.push_back((view.blob.centroid.v - at->v).norm());
      }
    }
  });
  return residuals_px.size() < kMinRepairViews ? std::numeric_limits<double>::infinity()
                                               : median(std::move(residuals_px));
}

// Leave-one-out: the camera without which the residual of the others is smallest. A bumped camera among few makes other
// cameras deviate, too. Nothing if too few views are left without any of them.
std::optional<std::uint32_t> leave_one_out(const MarkerRecording& recording, const Rig& rig) {
  std::optional<std::uint32_t> worst;
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t c = 0; c < rig.size(); ++c) {
    const double residual_px = residual_without_px(recording, rig, c);
    if (residual_px >= least) continue;
    least = residual_px;
    worst = c;
  }
  return worst;
}

// Repairs drifted cameras one after the other and measures the deviations again after each.
std::optional<Error> repair_drifted(const MarkerRecording& recording, std::vector<CameraDeviation> deviations,
                                    RepairedRig& repaired) {
  Rig& rig = repaired.rig;
  for (;;) {
    const auto drifted = std::ranges::count_if(deviations, &CameraDeviation::drifted);
    if (drifted == 0) return std::nullopt;
    if (2 * (repaired.cameras.size() + 1) > rig.size()) {
      return refusal(
          fmt::format("more than {} of {} cameras deviate from the rig: too many to repair them from the others; "
                      "calibrate again with mocap-calibrate wand",
                      repaired.cameras.size(), rig.size()));
    }
    const bool enough = static_cast<std::ptrdiff_t>(rig.size()) - drifted >= kMinUndriftedCameras;
    const auto worst = std::ranges::max_element(
        deviations, {}, [](const CameraDeviation& deviation) { return deviation.drifted ? deviation.off_px : -1.0; });
    const std::optional<std::uint32_t> found =
        enough ? static_cast<std::uint32_t>(worst - deviations.begin()) : leave_one_out(recording, rig);
    if (!found) {
      return refusal(
          fmt::format("{} of {} cameras deviate, and the moved one cannot be found: without any one camera, fewer than "
                      "{} views of markers that three others see are left; move markers in the common view of four "
                      "cameras, longer",
                      drifted, rig.size(), kMinRepairViews));
    }
    const std::uint32_t c = *found;
    std::vector<bool> excluded(rig.size(), false);
    for (std::size_t i = 0; i < rig.size(); ++i) excluded[i] = i == c || (enough && deviations[i].drifted);
    const CameraFromWorld initial = deviations[c].drifted ? deviations[c].camera_from_world : rig[c].camera_from_world;
    auto camera = repair_camera(recording, initial, excluded, CameraId{c}, rig);
    if (!camera) return camera.error();
    repaired.cameras.push_back(*std::move(camera));
    deviations = recording.deviations(rig);
  }
}

std::vector<ObservedMarker> observed_markers(const MarkerRecording& recording, const Rig& rig) {
  std::vector<ObservedMarker> all;
  recording.triangulate(rig, {}, [&](const TriangulatedSet& set) {
    for (const TriangulatedMarker& marker : set.markers) {
      ObservedMarker& observed = all.emplace_back();
      observed.point = marker.position;
      for (const auto& [camera, blob] : marker.views) {
        if (blob.merged || blob.touches_border) continue;
        observed.observations.push_back({static_cast<int>(camera.value), blob.centroid, blob.sigma_px});
      }
      if (observed.observations.size() < kMinViews) all.pop_back();
    }
  });
  return all;
}

/// The views of one camera.
struct Coverage {
  std::size_t views = 0;
  CoveredCells cells;

  KeptCamera of(const CameraModel& camera) const { return {camera.name, views, cells.count()}; }
};

std::vector<Coverage> coverage_of(const std::vector<ObservedMarker>& markers, const Rig& rig) {
  std::vector<Coverage> coverage(rig.size());
  for (const ObservedMarker& marker : markers) {
    for (const MarkerObservation& view : marker.observations) {
      const auto c = static_cast<std::size_t>(view.camera);
      ++coverage[c].views;
      coverage[c].cells.set(cell_of(view.at.v, rig[c].width_px, rig[c].height_px));
    }
  }
  return coverage;
}

/// The cameras that an adjustment leaves out.
struct LeftOut {
  std::vector<bool> cameras;     ///< by CameraId
  std::vector<KeptCamera> kept;  ///< the same
};

// Removes the views of cameras whose views do not determine their pose: they would pull the whole rig towards a camera
// that may have been bumped. A camera whose pose was just estimated and judged stays.
LeftOut leave_out_undetermined(const RepairedRig& repaired, std::vector<ObservedMarker>& markers) {
  const Rig& rig = repaired.rig;
  const std::vector<Coverage> whole = coverage_of(markers, rig);
  LeftOut left_out;
  left_out.cameras.assign(rig.size(), false);
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    const std::vector<Coverage> coverage = coverage_of(markers, rig);
    for (std::size_t c = 0; c < rig.size(); ++c) {
      const bool is_repaired =
          std::ranges::find(repaired.cameras, rig[c].name, &RepairedCamera::name) != repaired.cameras.end();
      if (left_out.cameras[c] || is_repaired || coverage[c].of(rig[c]).is_sufficient()) continue;
      left_out.cameras[c] = is_changed = true;
      left_out.kept.push_back(whole[c].of(rig[c]));
    }
    for (ObservedMarker& marker : markers) {
      std::erase_if(marker.observations, [&](const MarkerObservation& view) {
        return left_out.cameras[static_cast<std::size_t>(view.camera)];
      });
    }
    std::erase_if(markers, [](const ObservedMarker& marker) { return marker.observations.size() < kMinViews; });
  }
  return left_out;
}

// Names the cameras whose own views do not suffice; the others lack only markers that these cameras see, too.
Error nothing_left(const std::vector<KeptCamera>& kept) {
  std::string figures;
  for (const KeptCamera& camera : kept) {
    if (camera.is_sufficient()) continue;
    figures += fmt::format("{}camera '{}' has {} views in {} of the {} parts of its image", figures.empty() ? "" : ", ",
                           camera.name, camera.views, camera.cells, CoveredCells{}.size());
  }
  return refusal(
      fmt::format("the views of markers that three cameras see do not determine the rig: {}, expected at least {} in "
                  "{}, and without these views too few markers are left; move markers through the whole image of "
                  "these cameras, where two other cameras see them, too",
                  figures, kMinRepairViews, kMinCoveredCells));
}

}  // namespace

std::string reason_of(const KeptCamera& camera) {
  if (camera.views < kMinRepairViews) {
    return fmt::format("only {} views of markers that three cameras see, expected at least {}", camera.views,
                       kMinRepairViews);
  }
  if (camera.cells < kMinCoveredCells) {
    return fmt::format("its {} views of markers cover only {} of {} parts of its image, expected at least {}",
                       camera.views, camera.cells, CoveredCells{}.size(), kMinCoveredCells);
  }
  return fmt::format("too few of its {} views are of markers that three cameras see without the other kept ones",
                     camera.views);
}

Result<RepairedRig> repair_rig(const MarkerRecording& recording, const Rig& before,
                               std::vector<CameraDeviation> deviations, int threads) {
  RepairedRig repaired;
  repaired.rig = before;
  if (auto error = repair_drifted(recording, std::move(deviations), repaired)) return *std::move(error);
  RefineRigSettings settings;
  settings.threads = threads;
  auto markers = observed_markers(recording, repaired.rig);
  const bool are_enough = markers.size() >= kMinRefinedMarkers;
  LeftOut left_out;
  if (are_enough) left_out = leave_out_undetermined(repaired, markers);
  if (are_enough && markers.size() < kMinRefinedMarkers) return nothing_left(left_out.kept);
  auto refined = refine_rig(repaired.rig, thin_out(markers, kMaxMarkersUsed), settings);
  if (!refined) {
    return refusal(
        fmt::format("{} markers that three cameras or more see, expected at least {}; move markers through the whole "
                    "volume, longer",
                    markers.size(), kMinRefinedMarkers));
  }
  for (std::size_t c = 0; c < before.size(); ++c) {
    if (left_out.cameras[c]) refined->rig[c] = repaired.rig[c];  // without the rounding of the adjustment
  }
  const auto after = recording.deviations(refined->rig);
  for (std::size_t c = 0; c < after.size(); ++c) {
    if (after[c].drifted && !left_out.cameras[c]) {
      return refusal(
          fmt::format("camera '{}' still deviates by {:.2f} px: no motion of the camera explains its views; was its "
                      "lens touched? Calibrate again with mocap-calibrate wand",
                      before[c].name, after[c].off_px));
    }
  }
  repaired.kept = std::move(left_out.kept);
  repaired.rig = std::move(refined->rig);
  repaired.before_px = refined->before_px;
  repaired.after_px = refined->after_px;
  return repaired;
}

}  // namespace mocap::calibration
