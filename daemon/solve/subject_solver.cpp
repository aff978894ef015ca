#include "solve/subject_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/expects.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::solve {
namespace {

// Bounds of the published standard deviation of a marker by the pose. Chosen by hand; not yet measured.
constexpr double kMinMarkerSigma_m = 0.005;
constexpr double kMaxMarkerSigma_m = 0.15;
// A bearing-only observation counts if its marker was measured in the set before and the predicted position has at most
// this standard deviation across the ray; else from the second set on in which the same camera detects the marker
// (decision 0005). Chosen by hand; not yet measured.
constexpr double kMaxTransverseSigma_m = 0.02;
constexpr int kMinBearingSets = 2;
// Gate of a bearing-only observation, on the distance of the predicted position from the ray.
constexpr double kBearingGateSigmas = 4.0;
// Standard deviation of the motion model: a constant and a share of the step from set to set. A hand that is thrown is
// 2 to 4 cm from its prediction (decision 0004).
constexpr double kPredictionSigma_m = 0.005;
constexpr double kPredictionSigmaPerStep = 0.3;
// Largest speed of a marker, and largest gap, between two bearing-only observations of one marker. Chosen by hand; not
// yet measured.
constexpr double kMaxSpeed_m_s = 12.0;
constexpr double kMaxBearingGap_s = 0.1;
// Standard deviation of an ambiguous observation beside its spread. Chosen by hand; not yet measured.
constexpr double kAmbiguousSigma_m = 0.01;
// The marker noise of a subject is 1.5 times its usual rms residual, between this bound and the setting, with this time
// constant. Fewer markers fit any body and do not count. Chosen by hand; not yet measured.
constexpr double kMinSkinSigma_m = 0.0005;
constexpr double kResidualToSigma = 1.5;
constexpr double kSkinTimeConstant_s = 0.5;
constexpr std::size_t kMinMarkersForSkin = 6;
// Confidence of a marker on a ray; a marker without any observation has exp(-t) of it after t seconds. Chosen by hand;
// not yet measured.
constexpr float kBearingConfidence = 0.8F;

pose::SkeletonTrackerSettings tracker_settings(const SolveSettings& settings) {
  return {.outlier_m = settings.outlier_m, .max_iterations = settings.max_iterations};
}

}  // namespace

SubjectSolver::SubjectSolver(const SolveSettings& settings, const Subject& subject)
    : settings_(settings),
      body_(subject.marker_set, tracker_settings(settings)),
      transition_smoother_(subject.marker_set.skeleton.bones.size()),
      smoother_(settings.smoothing, subject.marker_set.skeleton.bones.size()) {
  const auto& bones = subject.marker_set.skeleton.bones;
  const std::size_t markers = subject.marker_set.markers.size();
  MOCAP_EXPECTS(bones.size() <= kMaxBones && markers <= kMaxLabels);
  for (const Bone& bone : bones) parents_.push_back(bone.parent);
  bones_.resize(bones.size());
  bearing_memories_.resize(markers);
  covariances_m2_.resize(markers, Eigen::Matrix3d::Identity());
  observation_kind_.resize(markers, ObservationKind::None);
  bearing_of_.resize(markers);
  own_markers_.resize(bones.size());
  for (const MarkerOnBone& marker : subject.marker_set.markers) ++own_markers_[static_cast<std::size_t>(marker.bone)];
  rotation_is_visible_.resize(bones.size());
  for (const MarkerOnBone& marker : subject.marker_set.markers) {
    int bone =
        marker.offset_m.norm() > kinematics::kInJoint_m ? marker.bone : parents_[static_cast<std::size_t>(marker.bone)];
    for (; bone >= 0; bone = parents_[static_cast<std::size_t>(bone)])
      rotation_is_visible_[static_cast<std::size_t>(bone)] = true;
  }
  seen_markers_.resize(bones.size());
  changed_.resize(bones.size());
  changed_neighbours_.resize(bones.size());
  world_.resize(bones.size());
  locals_before_refit_.resize(bones.size());
  observations_.reserve(markers);
}

// While a body is tracked, the new model is applied between the two fits of the next set (decision 0003).
void SubjectSolver::refit(const SubjectFit& fit) {
  if (body_.is_tracking()) {
    refit_ = fit;
  } else {
    set_body(fit);
  }
}

void SubjectSolver::set_body(const SubjectFit& fit) {
  body_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
  if (fit.at_identification) body_.reset_joint_calibration();
}

void SubjectSolver::archive(Archive& members) {
  members(body_, transition_smoother_, smoother_, bones_, bearing_memories_, covariances_m2_, identifications_,
          published_at_, skin_at_, usual_residual_m_, skin_sigma_m_, pose_is_observable_, is_first_set_, refit_);
  const bool fits = !refit_ || (refit_->rest_offsets_m.size() == bones_.size() &&
                                refit_->marker_offsets_m.size() == covariances_m2_.size());
  if (!fits) members.fail();
}

// Second fit of the set, with the new body model. The difference to the first fit is the effect of the model.
void SubjectSolver::apply_refit() {
  std::copy(body_.pose().locals().begin(), body_.pose().locals().end(), locals_before_refit_.begin());
  set_body(*refit_);
  refit_.reset();
  (void)body_.update(observations_);
  refitted_ = true;
}

// A marker observes its bone and the parent bone, whose distal end is the joint of the bone.
void SubjectSolver::record_observation(std::size_t marker, ObservationKind kind) {
  observation_kind_[marker] = kind;
  const auto bone = static_cast<std::size_t>(body_.pose().marker_set().markers[marker].bone);
  // Any odd multiplier with well mixed bits (2^64 over the golden ratio): sums of different sets of markers differ.
  const std::uint64_t hash = (2 * marker + (kind == ObservationKind::Bearing ? 2 : 1)) * 0x9E37'79B9'7F4A'7C15U;
  bones_[bone].markers_now += hash;
  if (parents_[bone] >= 0) bones_[static_cast<std::size_t>(parents_[bone])].markers_now += hash;
}

// Observations of the measured markers.
void SubjectSolver::gather(const SubjectLabels& labels) {
  observations_.clear();
  std::fill(seen_markers_.begin(), seen_markers_.end(), 0);
  std::fill(observation_kind_.begin(), observation_kind_.end(), ObservationKind::None);
  std::fill(bearing_of_.begin(), bearing_of_.end(), nullptr);
  for (BoneMemory& bone : bones_) bone.markers_now = 0;
  const MarkerSet& set = body_.pose().marker_set();
  for (std::size_t m = 0; m < labels.markers.size() && m < observation_kind_.size(); ++m) {
    const LabelledMarker& label = labels.markers[m];
    if (label.state != LabelState::Measured || !label.position.v.allFinite()) continue;
    observations_.push_back(
        kinematics::observe_point(static_cast<int>(m), label.position.v, label.covariance_m2, skin_sigma_m_));
    record_observation(m, ObservationKind::Measured);
    const auto bone = static_cast<std::size_t>(set.markers[m].bone);
    ++seen_markers_[bone];
  }
}

// Whether an accepted bearing-only observation is of a marker on this bone, its parent or a child.
bool SubjectSolver::is_covered_by_bearing(std::size_t marker) const {
  const auto& markers = body_.pose().marker_set().markers;
  const int bone = markers[marker].bone;
  for (std::size_t m = 0; m < bearing_of_.size(); ++m) {
    if (bearing_of_[m] == nullptr) continue;
    const int other = markers[m].bone;
    if (other == bone || parents_[static_cast<std::size_t>(other)] == bone ||
        parents_[static_cast<std::size_t>(bone)] == other)
      return true;
  }
  return false;
}

// Adds ambiguous observations of markers without another observation. A limb with a bearing-only observation needs
// none: the label of the ray is known.
void SubjectSolver::gather_ambiguous(SubjectId id, std::span<const AmbiguousObservation> ambiguous_observations) {
  for (const AmbiguousObservation& one : ambiguous_observations) {
    const std::size_t m = one.label.marker;
    if (one.label.subject != id || m >= observation_kind_.size() || observation_kind_[m] != ObservationKind::None ||
        is_covered_by_bearing(m))
      continue;
    kinematics::Observation& seen = observations_.emplace_back();
    seen.marker = static_cast<int>(m);
    seen.position = one.position.v;
    seen.sigma_m = std::hypot(kAmbiguousSigma_m, one.sigma_m);
    seen.is_ambiguous = true;
  }
}

// Estimates the marker noise of this subject (decision 0002). If the noise were too large, the priors would deform a
// pose that fits the markers.
void SubjectSolver::update_skin_sigma(Timestamp at) {
  if (observations_.size() < kMinMarkersForSkin) return;
  const double share = 1.0 - std::exp(-std::max(0.0, to_s(at - skin_at_)) / kSkinTimeConstant_s);
  // A larger residual takes effect at once, a smaller one with the time constant.
  const double residual_m = body_.residual_m();
  usual_residual_m_ += (residual_m > usual_residual_m_ ? 1.0 : share) * (residual_m - usual_residual_m_);
  skin_at_ = at;
  skin_sigma_m_ = std::min(settings_.marker_sigma_m, std::max(kMinSkinSigma_m, kResidualToSigma * usual_residual_m_));
}

// Adds the bearing-only observations of markers that are not measured and that are inside the gate.
void SubjectSolver::gather_bearings(SubjectId id, std::span<const LabelledBearing> rays, Timestamp at) {
  for (const LabelledBearing& ray : rays) {
    const std::size_t m = ray.label.marker;
    if (ray.label.subject != id || m >= observation_kind_.size() || observation_kind_[m] != ObservationKind::None)
      continue;
    if (!passes_bearing_gate(m, ray, at)) continue;
    observations_.push_back(kinematics::observe_ray(static_cast<int>(m), ray.eye.v, ray.direction, ray.sigma_rad,
                                                    body_.pose().marker_at(m), skin_sigma_m_));
    record_observation(m, ObservationKind::Bearing);
    bearing_of_[m] = &ray;
  }
}

// Whether a bearing-only observation is accepted. Stores the observation, to count consecutive sets of one camera.
bool SubjectSolver::passes_bearing_gate(std::size_t marker, const LabelledBearing& ray, Timestamp at) {
  if (!ray.eye.v.allFinite() || !ray.direction.allFinite() || !(ray.sigma_rad >= 0.0)) return false;
  const Eigen::Vector3d from_eye = body_.predicted_position(marker) - ray.eye.v;
  const double depth_m = from_eye.dot(ray.direction);
  if (!(depth_m > 0.0)) return false;
  const double gap_s = to_s(at - bearing_memories_[marker].at);
  BearingMemory& memory = bearing_memories_[marker];
  const double moved_m = depth_m * (ray.direction - memory.direction).norm();
  const bool is_consecutive = memory.sets > 0 && memory.camera == ray.camera && gap_s > 0.0 &&
                              gap_s < kMaxBearingGap_s && moved_m < kMaxSpeed_m_s * gap_s;
  memory = {ray.camera, ray.direction, at, is_consecutive ? memory.sets + 1 : 1};

  const Eigen::Matrix3d& covariance_m2 = covariances_m2_[marker];
  const double across_m2 =
      std::max(0.0, 0.5 * (covariance_m2.trace() - ray.direction.dot(covariance_m2 * ray.direction)));
  const double off_m = (from_eye - depth_m * ray.direction).norm();
  const double step_m = body_.speed_of(marker) * to_s(at - body_.committed_at());
  const double motion_error_m = kPredictionSigma_m + kPredictionSigmaPerStep * step_m;
  const double off_m2 = across_m2 + motion_error_m * motion_error_m + std::pow(ray.sigma_rad * depth_m, 2);
  if (off_m > kBearingGateSigmas * std::sqrt(off_m2)) return false;
  const bool just_measured = body_.unseen_s(marker, body_.committed_at()) == 0.0;
  return (just_measured && across_m2 < kMaxTransverseSigma_m * kMaxTransverseSigma_m) || memory.sets >= kMinBearingSets;
}

// Covariances of the marker positions by the pose: of a measured marker from the residual of the fit, of another marker
// from the joints between the marker and the observed markers.
void SubjectSolver::compute_marker_covariances(Timestamp at) {
  pose_is_observable_ = body_.compute_covariances(observations_, at);
  const Eigen::Matrix3d residual = std::pow(body_.residual_m(), 2) * Eigen::Matrix3d::Identity();
  for (std::size_t m = 0; m < covariances_m2_.size(); ++m) {
    if (observation_kind_[m] == ObservationKind::Measured) {
      covariances_m2_[m] = kMinMarkerSigma_m * kMinMarkerSigma_m * Eigen::Matrix3d::Identity() + residual;
      continue;
    }
    covariances_m2_[m].setIdentity();
    if (pose_is_observable_) covariances_m2_[m] = body_.predicted_covariance(m) + residual;
    const double most = covariances_m2_[m].trace() / (kMaxMarkerSigma_m * kMaxMarkerSigma_m);
    if (!(most < 1.0)) covariances_m2_[m] /= most;
    if (!covariances_m2_[m].allFinite())
      covariances_m2_[m] = std::pow(kMaxMarkerSigma_m, 2) * Eigen::Matrix3d::Identity();
  }
}

// Fills in the labels that were not measured. On a ray the position is projected onto the ray, and the covariance
// across the ray is that of the observation.
void SubjectSolver::fill(SubjectLabels& labels, Timestamp at) {
  for (std::size_t m = 0; m < labels.markers.size() && m < observation_kind_.size(); ++m) {
    LabelledMarker& label = labels.markers[m];
    if (label.state == LabelState::Measured) continue;
    const double unseen_s = body_.unseen_s(m, at);
    const LabelledBearing* const ray = bearing_of_[m];
    if (ray == nullptr && unseen_s > settings_.fill_for_s) {
      label.state = LabelState::Lost;
      label.confidence = 0.0F;
      continue;
    }
    label.state = LabelState::Filled;
    label.position.v = body_.predicted_position(m);
    label.covariance_m2 = covariances_m2_[m];
    label.residual_px = 0.0;
    label.cameras = 0;
    label.seen_by = 0;
    label.confidence = kBearingConfidence * static_cast<float>(std::exp(-unseen_s));
    if (ray == nullptr) continue;
    const Eigen::Vector3d& d = ray->direction;
    const double depth_m = (label.position.v - ray->eye.v).dot(d);
    label.position.v = ray->eye.v + depth_m * d;
    const double along_m2 = d.dot(label.covariance_m2 * d);
    const double across_m2 = std::pow(ray->sigma_rad * depth_m, 2);
    label.covariance_m2 = across_m2 * Eigen::Matrix3d::Identity() + (along_m2 - across_m2) * d * d.transpose();
    label.cameras = 1;
    label.seen_by = bit_of(ray->camera);
    label.confidence = kBearingConfidence;
  }
}

// State at the start of a track.
void SubjectSolver::restart(Timestamp at) {
  for (BearingMemory& ray : bearing_memories_) ray.sets = 0;
  usual_residual_m_ = skin_sigma_m_ = settings_.marker_sigma_m;
  skin_at_ = at;
  is_first_set_ = true;
}

void SubjectSolver::solve(SubjectLabels& labels, std::span<const LabelledBearing> rays,
                          std::span<const AmbiguousObservation> ambiguous_observations, Timestamp at,
                          SubjectPose& into) {
  into.bones.clear();
  into.residual_m = 0.0;
  into.smoothing_delay_s = 0.0;
  const bool is_tracked = labels.phase == SubjectPhase::Tracking;
  if (!is_tracked || labels.identifications != identifications_ || at < body_.committed_at()) end_track();
  identifications_ = labels.identifications;
  if (!is_tracked) return;
  gather(labels);
  if (!body_.is_tracking()) {
    if (!body_.start(observations_, at)) return;
    restart(at);
  } else {
    body_.predict(at);
    gather_bearings(labels.subject, rays, at);
    gather_ambiguous(labels.subject, ambiguous_observations);
    (void)body_.update(observations_);
    if (refit_) apply_refit();
    body_.commit(observations_);
    update_skin_sigma(at);
  }
  compute_marker_covariances(at);
  write_pose(at, into);
  fill(labels, at);
}

void SubjectSolver::end_track() {
  body_.reset();
  if (const std::optional<SubjectFit> fit = std::exchange(refit_, std::nullopt)) refit(*fit);
}

void SubjectSolver::adopt(SubjectSolver& before) {
  const SolveSettings settings = settings_;
  const bool same_smoothing = settings.smoothing == before.settings_.smoothing;
  pose::PoseSmoother smoother = std::move(same_smoothing ? before.smoother_ : smoother_);
  *this = std::move(before);
  settings_ = settings;
  smoother_ = std::move(smoother);
  body_.set_settings(tracker_settings(settings));
}

void SubjectSolver::predict(SubjectId id, Timestamp at, PredictedMarkers& into) {
  if (!body_.is_tracking()) return;
  body_.predict(at);
  for (std::size_t m = 0; m < covariances_m2_.size(); ++m) {
    const Label label{id, static_cast<std::uint32_t>(m)};
    if (!into.try_push_back({{body_.predicted_position(m)}, covariances_m2_[m], {}, label, 0})) return;
  }
}

}  // namespace mocap::solve
