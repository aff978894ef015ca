#include "pose/skeleton_tracker.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "kinematics/kinematic_tree.h"
#include "kinematics/rotation.h"
#include "model/bounds.h"

namespace mocap::pose {
namespace {

// Standard deviation of a rotation from its prediction about axes that no marker observes, of a joint that markers
// observe about other axes: the twist of a limb, or a hidden elbow about the line from shoulder to wrist. Chosen by
// hand; not yet measured.
constexpr double kUnobservedAxisSigma_rad = 0.1;
// The same for a bone that one ray alone observes. The ray first determines the rotation of the parent, if that is
// hidden, too. Chosen by hand; not yet measured.
constexpr double kBearingOnlySigma_rad = 0.05;
// Factor on rest pose and range priors of an observed joint. A marker with 3 mm skin motion, 6 cm from the axis,
// determines a rotation to 3 degrees; the prior must not bias that by more than 0.1 degree, even one radian beyond the
// range.
constexpr double kObservedPriorFraction = 0.05;
// Trace of the observed fraction, less two for the other two axes, above which the whole rotation counts as observed.
// Chosen by hand; not yet measured.
constexpr double kFullyObservedFraction = 0.8;
// Standard deviation of the prediction of a joint that no marker observes about any axis. Chosen by hand; not yet
// measured.
constexpr double kUnseenJointSigma_rad = 0.02;
// Time constant with which a hidden joint reverts to its running mean (decision 0012).
constexpr double kMeanReversionTimeConstant_s = 0.5;
// Standard deviation of a marker's position on the body: skin motion and fit. Chosen by hand; not yet measured.
constexpr double kSkinSigma_m = 0.005;
// Scale of the robust cost in the wide search, and one that disables it. Chosen by hand; not yet measured.
constexpr double kWideOutlier_m = 0.3;
constexpr double kNoOutlier_m = 1e3;
// Fits with the same observing markers that share one computation of the observed fractions. Chosen by hand; not yet
// measured.
constexpr int kCovarianceInterval = 8;
constexpr double kNever_s = 1e3;
// Bound on the observations of one fit: all labels and all ambiguous observations.
constexpr std::size_t kMostObservations = kMaxLabels + kMaxMarkers;

}  // namespace

SkeletonTracker::SkeletonTracker(const MarkerSet& set, const SkeletonTrackerSettings& settings)
    : settings_(settings),
      pose_(set, kinematics::PoseFit::Lengths::Fixed),
      initial_pose_(set),
      joint_drift_(set.skeleton.bones.size()),
      mean_rotation_(set.skeleton.bones.size()),
      hinge_axes_(set.skeleton),
      swivel_planes_(set.skeleton) {
  const std::size_t bones = set.skeleton.bones.size();
  bones_.resize(bones);
  markers_.resize(set.markers.size());
  depth_hypotheses_.resize(set.markers.size());
  for (const Bone& bone : set.skeleton.bones) {
    bone_depth_.push_back(bone.parent < 0 ? 0 : bone_depth_[static_cast<std::size_t>(bone.parent)] + 1);
    const auto is_locked = [&](const auto& range) { return bone.parent >= 0 && !range; };
    locked_axes_.push_back(static_cast<double>(std::ranges::count_if(bone.rotation_limits, is_locked)));
  }
  committed_.resize(bones);
  predicted_.resize(bones);
  fitted_.resize(bones);
  start_pose_.resize(bones);
  fallback_pose_.resize(bones);
  trial_pose_.resize(bones);
  straight_pose_.resize(bones);
  is_below_.resize(bones);
  limb_prior_pose_.resize(bones);
  squared_error_m2_.resize(bones);
  marker_count_.resize(bones);
  for (auto* confidence : {&rest_confidence_, &limit_confidence_, &limb_rest_confidence_, &limb_limit_confidence_})
    confidence->resize(bones);
  for (auto* weight : {&prior_information_, &limb_prior_information_}) weight->resize(bones);
  covariance_inputs_.reserve(2 * set.markers.size());
  unreliable_.resize(bones);
  reinitialised_.resize(bones);
  pairs_.reserve(set.markers.size() + 1);  // one more for a joint
}

void SkeletonTracker::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                            std::span<const Eigen::Vector3d> marker_offsets_m) {
  pose_.refit(rest_offsets_m, marker_offsets_m);
  for (MarkerMemory& marker : markers_) marker.bias_m.setZero();
  covariance_age_ = kCovarianceInterval;
  refitted_ = true;
}

void SkeletonTracker::archive(Archive& members) {
  members(pose_, is_tracking_, refitted_, committed_at_, at_, residual_m_, velocity_m_s_, interval_, bones_, markers_,
          committed_, predicted_, fitted_, joint_drift_, mean_rotation_, depth_hypotheses_, hinge_axes_, swivel_planes_,
          covariance_age_, unreliable_, reinitialised_);
  archive_covariance_inputs(members);
}

// Their number differs from set to set.
void SkeletonTracker::archive_covariance_inputs(Archive& members) {
  const std::size_t count = members.count(covariance_inputs_.size(), kMostObservations);
  if (members.is_reading()) covariance_inputs_.resize(count);
  for (CovarianceInput& input : covariance_inputs_) members(input);
}

void SkeletonTracker::reset() {
  is_tracking_ = false;
  covariance_age_ = kCovarianceInterval;
  for (MarkerMemory& marker : markers_) marker.ever_seen = false;
}

void SkeletonTracker::reset_joint_calibration() {
  hinge_axes_.reset();
  swivel_planes_.reset();
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    pose_.set_hinge_axis(b, hinge_axes_.nominal_from_calibrated(b));
    pose_.set_swivel_plane(b, swivel_planes_.plane(b));
  }
}

// Aligns the rest pose with the observations, weighted towards the trunk, and fits. A second fit begins at the pose of
// InitialPoseSolver, because a strongly bent body is far from the rest pose. The fit of lower cost is kept.
bool SkeletonTracker::start(std::span<const kinematics::Observation> seen, Timestamp at) {
  reset();
  pairs_.clear();
  pose_.place({});
  for (const kinematics::Observation& one : seen) {
    if (one.bearing_only || !kinematics::is_usable(one)) continue;
    const auto m = static_cast<std::size_t>(one.marker);
    const int depth = bone_depth_[static_cast<std::size_t>(pose_.marker_set().markers[m].bone)];
    pairs_.push_back({pose_.marker_at(m), one.position, std::pow(0.2, depth)});
  }
  const std::optional<geometry::RigidFit> aligned = geometry::fit_rigid(pairs_);
  if (!aligned) return false;
  pose_.place(aligned->to_from);
  const int iterations = 5 * settings_.max_iterations;
  (void)pose_.solve(seen, {.rest_range_fraction = kinematics::kRestRangeFraction, .outlier_m = 0.5}, iterations);
  const kinematics::PosePrior prior{.rest_range_fraction = kinematics::kRestRangeFraction,
                                    .outlier_m = settings_.outlier_m};
  kinematics::PoseFitResult result = pose_.solve(seen, prior, iterations);
  std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  if (initial_pose_.solve(pose_.marker_set(), seen, trial_pose_)) {
    pose_.set_locals(trial_pose_);
    const kinematics::PoseFitResult second = pose_.solve(seen, prior, iterations);
    if (second.cost < result.cost) {
      result = second;
    } else {
      pose_.set_locals(fallback_pose_);
    }
  }
  residual_m_ = result.rms_m;
  velocity_m_s_.setZero();
  interval_.reset();
  update_observability(seen);
  joint_drift_.reset();
  mean_rotation_.reset();
  for (BoneMemory& bone : bones_) {
    bone.angular_velocity_rad_s.setZero();
    bone.fully_observed_at = at - from_s(kNever_s);
  }
  for (const kinematics::Observation& one : seen) {
    if (one.bearing_only || !kinematics::is_usable(one)) continue;
    MarkerMemory& marker = markers_[static_cast<std::size_t>(one.marker)];
    marker = {at, true, Eigen::Vector3d::Zero(), one.position, Eigen::Vector3d::Zero()};
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), committed_.begin());
  std::copy(committed_.begin(), committed_.end(), predicted_.begin());
  committed_at_ = at_ = at;
  is_tracking_ = true;
  refitted_ = false;
  return true;
}

void SkeletonTracker::predict(Timestamp at) {
  at_ = at;
  std::fill(unreliable_.begin(), unreliable_.end(), 0);
  std::fill(reinitialised_.begin(), reinitialised_.end(), 0);
  const double ahead_s = std::clamp(to_s(at - committed_at_), 0.0, kMaxGap_s);
  // Angle covered by an exponentially decaying velocity.
  const double coast_s = kCoastTimeConstant_s * (1.0 - std::exp(-ahead_s / kCoastTimeConstant_s));
  const double reversion = 1.0 - std::exp(-ahead_s / kMeanReversionTimeConstant_s);
  std::copy(committed_.begin(), committed_.end(), predicted_.begin());
  predicted_[0].position += ahead_s * velocity_m_s_;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const BoneMemory& bone = bones_[b];
    Eigen::Vector3d rotation_rad = coast_s * bone.angular_velocity_rad_s +
                                   (ahead_s - coast_s) * (bone.observed_fraction * bone.angular_velocity_rad_s);
    const Eigen::Vector3d to_mean = mean_rotation_.rotation_to_mean(b, predicted_[b].rotation);
    rotation_rad += reversion * (to_mean - bone.observed_fraction * to_mean);
    if (rotation_rad.isZero()) continue;
    predicted_[b].rotation = (kinematics::from_rotation_vector(rotation_rad) * predicted_[b].rotation).normalized();
  }
  pose_.set_locals(predicted_);
}

void SkeletonTracker::update_observability(std::span<const kinematics::Observation> seen) {
  const MarkerSet& set = pose_.marker_set();
  for (BoneMemory& bone : bones_) bone.observability = Observability::None;
  for (const kinematics::Observation& one : seen) {
    if (!kinematics::is_usable(one)) continue;
    const MarkerOnBone& marker = set.markers[static_cast<std::size_t>(one.marker)];
    const bool in_joint = kinematics::sits_in_joint(marker);
    int bone = marker.bone;
    if (in_joint) bone = set.skeleton.bones[static_cast<std::size_t>(bone)].parent;
    if (bone >= 0) {
      Observability& level = bones_[static_cast<std::size_t>(bone)].observability;
      level = std::max(level, one.bearing_only ? Observability::BearingOnly : Observability::Full);
    }
    while (bone >= 0) {
      BoneMemory& above = bones_[static_cast<std::size_t>(bone)];
      if (above.observability == Observability::None) above.observability = Observability::Descendant;
      bone = set.skeleton.bones[static_cast<std::size_t>(bone)].parent;
    }
  }
}

kinematics::PosePrior SkeletonTracker::make_prior(std::size_t seen) const {
  kinematics::PosePrior prior;
  prior.rest_range_fraction = kinematics::kRestRangeFraction;
  prior.limit_sigma_rad = kinematics::kRangeSigma_rad;
  prior.prior_information = prior_information_;
  // One or two markers do not determine the root's position and rotation together.
  prior.prior_root_sigma_m = seen < 3 ? 0.05 : 1.0;
  prior.outlier_m = settings_.outlier_m;
  return prior;
}

void SkeletonTracker::mark_unreliable(std::span<const char> bones) {
  unreliable_.assign(bones.begin(), bones.end());
  const MarkerSet& set = pose_.marker_set();
  for (const MarkerOnBone& marker : set.markers) {
    const auto bone = static_cast<std::size_t>(marker.bone);
    const int parent = set.skeleton.bones[bone].parent;
    if (bones[bone] != 0 && parent > 0 && kinematics::sits_in_joint(marker))
      unreliable_[static_cast<std::size_t>(parent)] = 1;
  }
}

// Computes how much of each joint's rotation the markers observe: I - posterior covariance / prior covariance, with a
// weak isotropic prior; 1 about a locked axis, whose rotation is known. Recomputed when the set of observations
// changes, and every kCovarianceInterval fits.
void SkeletonTracker::update_observed_fractions(std::span<const kinematics::Observation> seen) {
  const auto same = [](const kinematics::Observation& one, const CovarianceInput& was) {
    return one.marker == was.marker && one.bearing_only == was.bearing_only && kinematics::is_usable(one) == was.usable;
  };
  if (covariance_age_ < kCovarianceInterval &&
      std::equal(seen.begin(), seen.end(), covariance_inputs_.begin(), covariance_inputs_.end(), same)) {
    ++covariance_age_;
    return;
  }
  covariance_age_ = 1;
  covariance_inputs_.clear();
  for (const kinematics::Observation& one : seen)
    covariance_inputs_.push_back({one.marker, one.bearing_only, kinematics::is_usable(one)});
  std::fill(prior_information_.begin(), prior_information_.end(),
            Eigen::Matrix3d::Identity() / (settings_.observability_prior_rad * settings_.observability_prior_rad));
  std::fill(rest_confidence_.begin(), rest_confidence_.end(), 0.0);
  kinematics::PosePrior prior = make_prior(seen.size());
  prior.rest_confidence = rest_confidence_;
  prior.limit_confidence = rest_confidence_;
  prior.outlier_m = kNoOutlier_m;  // observability does not depend on the residual
  const bool has_covariance = pose_.compute_covariances(seen, prior);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    bones_[b].observed_fraction.setZero();
    if (has_covariance)
      bones_[b].observed_fraction =
          Eigen::Matrix3d::Identity() -
          pose_.local_covariance(b) / (settings_.observability_prior_rad * settings_.observability_prior_rad);
  }
}

kinematics::PoseFitResult SkeletonTracker::update(std::span<const kinematics::Observation> seen) {
  pose_.set_locals(predicted_);
  update_observability(seen);
  if (seen.empty()) return {};
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const bool needs_swivel_plane =
        bones_[b].observability == Observability::BearingOnly || bones_[b].observability == Observability::Descendant;
    pose_.set_swivel_plane(b, needs_swivel_plane ? swivel_planes_.plane(b) : kinematics::SwivelPlane{});
  }
  update_observed_fractions(seen);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const Eigen::Matrix3d& observed_fraction = bones_[b].observed_fraction;
    const Eigen::Matrix3d unobserved_fraction = Eigen::Matrix3d::Identity() - observed_fraction;
    const double any_axis = std::clamp(observed_fraction.trace() - locked_axes_[b], 0.0, 1.0);
    const double unobserved_sigma_rad = any_axis * kUnobservedAxisSigma_rad + (1.0 - any_axis) * kUnseenJointSigma_rad;
    prior_information_[b] = (kMotionSigma_rad * kMotionSigma_rad * observed_fraction +
                             unobserved_sigma_rad * unobserved_sigma_rad * unobserved_fraction)
                                .inverse();
    const double all_axes = std::max(0.0, 1.0 - unobserved_fraction.trace());
    if (all_axes > kFullyObservedFraction) bones_[b].fully_observed_at = at_;
    const double unobserved_s = std::max(0.0, to_s(at_ - bones_[b].fully_observed_at));
    const double recent_fraction = settings_.rest_prior_time_constant_s > 0.0
                                       ? any_axis * std::exp(-unobserved_s / settings_.rest_prior_time_constant_s)
                                       : 0.0;
    rest_confidence_[b] = 1.0 - (1.0 - kObservedPriorFraction) * std::max(all_axes, recent_fraction);
    limit_confidence_[b] = 1.0 - (1.0 - kObservedPriorFraction) * any_axis;
    if (bones_[b].observability == Observability::BearingOnly && is_weakly_observed(b)) {
      rest_confidence_[b] = limit_confidence_[b] = 1.0;
      const double min_sigma_rad = std::min(kBearingOnlySigma_rad, unobserved_sigma_rad);
      prior_information_[b] = (kBearingOnlySigma_rad * kBearingOnlySigma_rad * observed_fraction +
                               min_sigma_rad * min_sigma_rad * unobserved_fraction)
                                  .inverse();
    }
    if (unreliable_[b] != 0)
      prior_information_[b] = Eigen::Matrix3d::Identity() / (kMaxJointDrift_rad * kMaxJointDrift_rad);
  }
  kinematics::PosePrior prior = make_prior(seen.size());
  prior.rest_confidence = rest_confidence_;
  prior.limit_confidence = limit_confidence_;
  const kinematics::PoseFitEnd end{.max_iterations = settings_.max_iterations, .small_step = kConvergedStep};
  const kinematics::PoseFitResult result =
      resolve_depth_ambiguity(seen, prior, end, resolve_hinge_reflection(seen, prior, end, solve(seen, prior, end)));
  residual_m_ = result.rms_m;
  std::copy(pose_.locals().begin(), pose_.locals().end(), fitted_.begin());
  return result;
}

// Fits from the current pose. If markers keep large residuals, the fit may have ended in a wrong local minimum: a limb
// that returned elsewhere, or one with the wrong rotation. Then a wide search (large robust scale) and a
// reinitialisation of bone rotations precede a second fit, and the fit of lower cost is kept. The second fit can save
// at most the cost of those markers; it is skipped if that cannot bring the cost below `max_cost`.
kinematics::PoseFitResult SkeletonTracker::solve(std::span<const kinematics::Observation> seen,
                                                 const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                                                 double max_cost) {
  std::copy(pose_.locals().begin(), pose_.locals().end(), start_pose_.begin());
  const kinematics::PoseFitResult first = pose_.solve(seen, prior, end);
  double outlier_cost = 0.0;
  for (const kinematics::Observation& one : seen) {
    if (!kinematics::is_usable(one) ||
        kinematics::distance_m(one, pose_.marker_at(static_cast<std::size_t>(one.marker))) < settings_.outlier_m)
      continue;
    outlier_cost += 0.5 * kinematics::information_1_m2(one) * prior.outlier_m * prior.outlier_m;
  }
  if (outlier_cost == 0.0 || first.cost - outlier_cost > max_cost) return first;
  std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  pose_.set_locals(start_pose_);
  kinematics::PosePrior wide = prior;
  wide.outlier_m = kWideOutlier_m;
  (void)pose_.solve(seen, wide, {.max_iterations = 2 * end.max_iterations, .small_step = end.small_step});
  (void)reinitialise_bone_rotation(seen);
  const kinematics::PoseFitResult second = solve_with_and_without_prior_pose(seen, prior, end);
  if (second.cost < first.cost) return second;
  pose_.set_locals(fallback_pose_);
  return first;
}

Eigen::Vector3d SkeletonTracker::predicted_position(std::size_t marker) const {
  const auto bone = static_cast<std::size_t>(pose_.marker_set().markers[marker].bone);
  return pose_.marker_at(marker) + pose_.world()[bone].rotation * markers_[marker].bias_m;
}

double SkeletonTracker::unseen_s(std::size_t marker, Timestamp at) const {
  return markers_[marker].ever_seen ? std::max(0.0, to_s(at - markers_[marker].seen_at)) : kNever_s;
}

bool SkeletonTracker::compute_covariances(std::span<const kinematics::Observation> seen, Timestamp at) {
  relax_prior(seen, at);
  kinematics::PosePrior prior = make_prior(3);
  prior.prior_root_sigma_m = seen.empty() ? 0.1 : 1.0;
  return pose_.compute_covariances(seen, prior);
}

Eigen::Matrix3d SkeletonTracker::predicted_covariance(std::size_t marker) const {
  return pose_.covariance_of(marker) + kSkinSigma_m * kSkinSigma_m * Eigen::Matrix3d::Identity();
}

}  // namespace mocap::pose
