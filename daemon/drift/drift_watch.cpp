#include "drift/drift_watch.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/expects.h"
#include "base/time.h"
#include "geometry/lens.h"

namespace mocap::drift {
namespace {

// Markers observed in one set, in turn: bounds the work. Chosen by hand; not yet measured.
constexpr std::size_t kDriftMarkersPerSet = 8;
// A marker on which fewer cameras agree may itself be wrong: two rays meet by chance, three rarely.
constexpr std::uint32_t kMinAgreeingCameras = 3;
// An unmatched blob is observed if the next blob is this many times farther from the projection. Chosen by hand; not
// yet measured.
constexpr double kUniquenessRatio = 2.0;
// Scale of the Cauchy loss: larger errors get less weight. Chosen by hand; not yet measured.
constexpr double kRobustScale_px = 5.0;
// A camera is assessed from this weighted number of observations on, and compared with others from kMinViewsToCompare
// on. Chosen by hand; the delay that follows is measured by mocap-eval drift.
constexpr double kMinViews = 100.0;
constexpr double kMinViewsToCompare = 20.0;
// Share of the squared reprojection error that the pose change of a bumped camera explains at least; random errors are
// not explained. Chosen by hand; not yet measured.
constexpr double kMinExplainedShare = 0.5;
// Hysteresis: a drifted camera is in place again below this share of drift_px. Chosen by hand; not yet measured.
constexpr double kRecoveryRatio = 0.7;
// Prior standard deviations of a bump. They keep the equations regular when the markers do not separate rotation from
// translation. Chosen by hand; not yet measured.
constexpr double kRotationPrior_rad = 0.02;
constexpr double kTranslationPrior_m = 0.02;

// The least-squares pose change of a camera, the reprojection error that it explains, and whether it explains enough.
template <class Camera>
struct PoseChange {
  explicit PoseChange(const Camera& camera) {
    Eigen::Matrix<double, 6, 6> normal_matrix = camera.normal_matrix;
    normal_matrix.diagonal().template head<3>().array() += 1.0 / (kRotationPrior_rad * kRotationPrior_rad);
    normal_matrix.diagonal().template tail<3>().array() += 1.0 / (kTranslationPrior_m * kTranslationPrior_m);
    change = normal_matrix.ldlt().solve(camera.gradient);
    const double moved2 = change.dot(camera.normal_matrix * change);
    off_px = std::sqrt(std::max(0.0, moved2 / camera.views));
    explained = 2.0 * change.dot(camera.gradient) - moved2 > kMinExplainedShare * camera.residual_sum;
  }
  bool is_significant(double drift_px) const { return off_px > drift_px && explained; }

  Eigen::Matrix<double, 6, 1> change;
  double off_px = 0.0;
  bool explained = false;
};

}  // namespace

DriftWatch::DriftWatch(const DriftSettings& settings, Rig rig)
    : settings_(settings), rig_(std::move(rig)), cameras_(rig_.size()), matched_(rig_.size()) {
  MOCAP_EXPECTS(!rig_.empty() && rig_.size() <= kMaxCameras);
  for (std::size_t c = 0; c < rig_.size(); ++c) cameras_[c].drift.camera_from_world = rig_[c].camera_from_world;
}

CameraId DriftWatch::update(const FrameSet& frames, const Matches& matches, const Markers& markers) {
  forget(frames.exposed_at);
  mark_matched_blobs(frames, matches);
  const std::size_t count = std::min(markers.size(), kDriftMarkersPerSet);
  for (std::size_t i = 0; i < count; ++i) {
    const Marker& marker = markers[(next_marker_ + i) % markers.size()];
    if (marker.cameras >= kMinAgreeingCameras) observe_marker(marker, matches.matches[marker.match], frames);
  }
  next_marker_ += count;
  next_camera_ = (next_camera_ + 1) % cameras_.size();
  assess(next_camera_);
  return CameraId{static_cast<std::uint32_t>(next_camera_)};
}

void DriftWatch::forget(Timestamp now) {
  const double passed_s = updated_at_ ? to_s(now - *updated_at_) : 0.0;
  updated_at_ = now;
  const double decay = std::exp(-std::max(0.0, passed_s) / settings_.memory_s);
  for (Camera& camera : cameras_) {
    camera.normal_matrix *= decay;
    camera.gradient *= decay;
    camera.residual_sum *= decay;
    camera.views *= decay;
  }
}

void DriftWatch::mark_matched_blobs(const FrameSet& frames, const Matches& matches) {
  for (std::size_t v = 0; v < frames.views.size(); ++v) matched_[v].reset();
  for (const Match& match : matches.matches) {
    for (const BlobRef& sighting : match.sightings) matched_[sighting.view].set(sighting.blob);
  }
}

void DriftWatch::observe_marker(const Marker& marker, const Match& match, const FrameSet& frames) {
  for (std::size_t v = 0; v < frames.views.size(); ++v) {
    const BlobFrame& view = *frames.views[v];
    const std::size_t c = view.camera.value;
    const auto state = std::ranges::find(match.sightings, v, &BlobRef::view);
    if (state != match.sightings.end() && marker.cameras <= kMinAgreeingCameras) continue;
    // A point that a drifted camera contributes to is biased: it is no evidence about the other cameras.
    const auto is_moved = [&](const BlobRef& ref) {
      const std::size_t other = frames.views[ref.view]->camera.value;
      return other != c && cameras_[other].drift.drifted;
    };
    if (std::ranges::any_of(match.sightings, is_moved)) continue;
    const auto at = geometry::project(rig_[c], marker.position);
    if (!at || !geometry::in_image(rig_[c], *at)) continue;
    const Eigen::Vector3d in_camera = (rig_[c].camera_from_world * marker.position).v;
    if (state != match.sightings.end()) {
      // The point was fitted to this view as well, which shrinks the residual: 3 of the 2 n degrees of freedom are
      // used.
      const double n = marker.cameras;
      const Eigen::Vector2d seen =
          view.blobs[state->blob].centroid.v + Eigen::Vector2d(state->off_x_px, state->off_y_px);
      learn(c, in_camera, (seen - at->v) / (1.0 - 1.5 / n));
      continue;
    }
    const double reach_px = settings_.reach_deg * std::numbers::pi / 180.0 * rig_[c].lens.fx_px;
    if (const auto off = nearest_unmatched(view, v, at->v, reach_px)) learn(c, in_camera, *off);
  }
}

// The offset from `at` to the nearest blob; nothing if that blob is matched or merged, or if another one is near.
std::optional<Eigen::Vector2d> DriftWatch::nearest_unmatched(const BlobFrame& view, std::size_t index,
                                                             const Eigen::Vector2d& at, double reach_px) const {
  double nearest = reach_px;
  double second = 1e9;
  std::optional<Eigen::Vector2d> off;
  for (std::size_t b = 0; b < view.blobs.size(); ++b) {
    const Eigen::Vector2d from = view.blobs[b].centroid.v - at;
    const double distance = from.norm();
    if (distance >= nearest) {
      second = std::min(second, distance);
      continue;
    }
    second = off ? nearest : second;
    nearest = distance;
    off = from;
    if (matched_[index].test(b) || view.blobs[b].merged) second = 0.0;
  }
  return second < kUniquenessRatio * nearest ? std::nullopt : off;
}

void DriftWatch::learn(std::size_t camera, const Eigen::Vector3d& in_camera, const Eigen::Vector2d& off_px) {
  const Lens& lens = rig_[camera].lens;
  const Eigen::Vector2d ray = in_camera.head<2>() / in_camera.z();
  const Eigen::Matrix2d px_from_ray = geometry::distort_with_slope(lens, {ray}).px_from_ray;
  // Jacobians: of the ray by the point in the camera's frame (ray_from_point), and of the point by the rotation
  // (cross).
  Eigen::Matrix<double, 2, 3> ray_from_point;
  ray_from_point << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  ray_from_point /= in_camera.z();
  Eigen::Matrix3d cross;
  cross << 0.0, in_camera.z(), -in_camera.y(), -in_camera.z(), 0.0, in_camera.x(), in_camera.y(), -in_camera.x(), 0.0;
  Eigen::Matrix<double, 2, 6> slope;
  slope.leftCols<3>() = px_from_ray * ray_from_point * cross;
  slope.rightCols<3>() = px_from_ray * ray_from_point;
  const double weight = 1.0 / (1.0 + off_px.squaredNorm() / (kRobustScale_px * kRobustScale_px));
  Camera& state = cameras_[camera];
  state.normal_matrix.noalias() += weight * slope.transpose() * slope;
  state.gradient.noalias() += weight * slope.transpose() * off_px;
  state.residual_sum += weight * off_px.squaredNorm();
  state.views += weight;
}

void DriftWatch::assess(std::size_t camera) {
  Camera& state = cameras_[camera];
  CameraDrift& drift = state.drift;
  drift.views = state.views;
  if (state.views < 1.0) {
    // A drifted camera keeps its last figures: without markers, nothing shows that it is in place again.
    if (!drift.drifted) drift = {.camera_from_world = drift.camera_from_world};
    return;
  }
  const PoseChange bump(state);
  const Vector6& change = bump.change;
  drift.off_px = bump.off_px;
  drift.rms_px = std::sqrt(state.residual_sum / state.views);
  drift.turned_rad = change.head<3>().norm();
  const CameraFromWorld& before = rig_[camera].camera_from_world;
  const double angle = change.head<3>().norm();
  const Eigen::Matrix3d rotation_change = angle > 0.0
                                              ? Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix()
                                              : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  drift.camera_from_world.rotation = rotation_change * before.rotation;
  drift.camera_from_world.translation = rotation_change * before.translation + change.tail<3>();
  drift.moved_m = ((drift.camera_from_world.inverse() * CameraPoint{}).v - rig_[camera].centre().v).norm();
  if (state.views < kMinViews) return;
  if (drift.off_px < kRecoveryRatio * settings_.drift_px) drift.drifted = false;
  if (drift.drifted || !bump.is_significant(settings_.drift_px)) return;
  // With few cameras, a drifted camera biases the points and makes others look drifted, but less than itself.
  const auto is_worse = [&](const Camera& other) {
    if (other.drift.drifted || other.views < kMinViewsToCompare) return false;
    const PoseChange its(other);
    return its.off_px > bump.off_px && its.is_significant(settings_.drift_px);
  };
  if (std::ranges::any_of(cameras_, is_worse)) return;
  drift.drifted = true;
  // The observations of the other cameras used points that this camera biased: they are discarded.
  for (Camera& other : cameras_) {
    if (&other == &state || other.drift.drifted) continue;
    other = Camera{.drift = {.camera_from_world = other.drift.camera_from_world}};
  }
}

}  // namespace mocap::drift
