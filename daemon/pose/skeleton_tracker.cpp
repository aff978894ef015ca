#include "pose/skeleton_tracker.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// As kMotionSigma_rad, of the turns about other axes than those that markers tell: a limb about itself, an elbow that
// is hidden about the line from shoulder to wrist. They follow what the told ones lead to, and nothing drives them.
constexpr double kUnobservedAxisSigma_rad = 0.1;
// The same where one camera's ray is all that tells of a bone's own markers: what it tells is first the turn of the
// bone above, where that is hidden, too, and the bone lies as it commonly does.
constexpr double kBearingOnlySigma_rad = 0.05;
// What joints commonly do is believed so much where markers tell how a joint is turned: a marker on skin of 3 mm, 6 cm
// from the joint's axis, tells a turn to 3 degrees, and what is common must not move that by more than a tenth of a
// degree, even a radian beyond.
constexpr double kObservedPriorFraction = 0.05;
// Markers that tell so much of a joint's turn tell it whole.
constexpr double kFullyObservedFraction = 0.8;
// Steps under this leave less than a twentieth of a degree to be found: a step's square, and a share of what markers
// are off.
constexpr double kConvergedStep = 5e-4;
// Of a joint that no marker moves: it stays, and goes back to rest within seconds.
constexpr double kUnseenJointSigma_rad = 0.02;
// How hard a joint's range is: people reach beyond it by a little, markers that are seen are believed more.
constexpr double kLimitSigma_rad = 0.3;
// A joint's rest as a share of its range: collar bones (20 degrees) stay within 10, elbows where they are.
constexpr double kRestRangeFraction = 0.5;
// Motion that nobody sees dies away with this time constant, and a joint goes back to how it usually is with the
// other. People's shoulders, elbows, hips and knees over 0.05 to 0.5 s: 0.05 to 0.1 s and 0.5 s lead nearest.
constexpr double kCoastTimeConstant_s = 0.1;
constexpr double kMeanReversionTimeConstant_s = 0.5;
// A gap in the sets after which velocities mean nothing; and how far ahead a straight line says anything.
constexpr double kMaxGap_s = 0.25;
// How surely a marker is where the body puts it: skin, and the fit.
constexpr double kSkinSigma_m = 0.005;
constexpr double kInJoint_m = 1e-3;
// What a marker is off its place is learnt slowly and within bounds, so that a wrong one does not get into it.
constexpr double kBiasGain = 0.05;
constexpr double kMaxBias_m = 0.02;
// So far off a marker still pulls on its bone when others lead nowhere.
constexpr double kWideOutlier_m = 0.3;
constexpr double kNoOutlier_m = 1e3;
// So many fits by the same markers share one weighing of what they tell.
constexpr int kCovarianceInterval = 8;
// Nobody turns a joint by more between two sets; or, where its bone's own markers are hidden, against its motion.
constexpr double kMaxStepRotation_rad = 0.8;
constexpr double kMaxInnovation_rad = 0.25;
constexpr double kNever_s = 1e3;

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
  for (const Bone& bone : set.skeleton.bones)
    bone_depth_.push_back(bone.parent < 0 ? 0 : bone_depth_[static_cast<std::size_t>(bone.parent)] + 1);
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
  for (auto* believed : {&rest_confidence_, &limit_confidence_, &limb_rest_confidence_, &limb_limit_confidence_})
    believed->resize(bones);
  for (auto* weight : {&prior_information_, &limb_prior_information_}) weight->resize(bones);
  covariance_inputs_.reserve(2 * set.markers.size());
  unreliable_.resize(bones);
  reinitialised_.resize(bones);
  pairs_.reserve(set.markers.size() + 1);  // and a joint
}

void SkeletonTracker::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                            std::span<const Eigen::Vector3d> marker_offsets_m) {
  pose_.refit(rest_offsets_m, marker_offsets_m);
  for (MarkerMemory& marker : markers_) marker.bias_m.setZero();
  covariance_age_ = kCovarianceInterval;
  refitted_ = true;
}

void SkeletonTracker::reset() {
  is_tracking_ = false;
  covariance_age_ = kCovarianceInterval;
  for (MarkerMemory& marker : markers_) marker.ever_seen = false;
}

void SkeletonTracker::reset_joint_calibration() {
  hinge_axes_.reset();
  swivel_planes_.reset();
  for (std::size_t b = 0; b < bones_.size(); ++b) pose_.set_hinge_axis(b, hinge_axes_.nominal_from_calibrated(b));
}

// The rest pose laid on what was seen, the trunk's markers most, then bent to fit.
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
  const std::optional<geometry::RigidFit> laid = geometry::fit_rigid(pairs_);
  if (!laid) return false;
  pose_.place(laid->to_from);
  const int patience = 5 * settings_.max_iterations;
  (void)pose_.solve(seen, {.rest_range_fraction = kRestRangeFraction, .outlier_m = 0.5}, patience);
  const kinematics::PosePrior prior{.rest_range_fraction = kRestRangeFraction, .outlier_m = settings_.outlier_m};
  kinematics::PoseFitResult result = pose_.solve(seen, prior, patience);
  // From the rest pose a body that is bent far may be led astray; laid bone by bone it is not. The better of both.
  std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  if (initial_pose_.solve(pose_.marker_set(), seen, trial_pose_)) {
    pose_.set_locals(trial_pose_);
    const kinematics::PoseFitResult was_reinitialised = pose_.solve(seen, prior, patience);
    if (was_reinitialised.cost < result.cost) {
      result = was_reinitialised;
    } else {
      pose_.set_locals(fallback_pose_);
    }
  }
  residual_m_ = result.rms_m;
  velocity_m_s_.setZero();
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
  // The way that a speed which dies away leads to.
  const double coast_s = kCoastTimeConstant_s * (1.0 - std::exp(-ahead_s / kCoastTimeConstant_s));
  const double back = 1.0 - std::exp(-ahead_s / kMeanReversionTimeConstant_s);
  std::copy(committed_.begin(), committed_.end(), predicted_.begin());
  predicted_[0].position += ahead_s * velocity_m_s_;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const BoneMemory& bone = bones_[b];
    Eigen::Vector3d turn = coast_s * bone.angular_velocity_rad_s +
                           (ahead_s - coast_s) * (bone.observed_fraction * bone.angular_velocity_rad_s);
    const Eigen::Vector3d to_mean = mean_rotation_.rotation_to_mean(b, predicted_[b].rotation);
    turn += back * (to_mean - bone.observed_fraction * to_mean);
    if (turn.isZero()) continue;
    predicted_[b].rotation = (kinematics::from_rotation_vector(turn) * predicted_[b].rotation).normalized();
  }
  pose_.set_locals(predicted_);
}

void SkeletonTracker::update_observability(std::span<const kinematics::Observation> seen) {
  const MarkerSet& set = pose_.marker_set();
  for (BoneMemory& bone : bones_) bone.observability = Observability::None;
  for (const kinematics::Observation& one : seen) {
    if (!kinematics::is_usable(one)) continue;
    const MarkerOnBone& marker = set.markers[static_cast<std::size_t>(one.marker)];
    const bool in_joint = marker.offset_m.norm() < kInJoint_m;
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
  prior.rest_range_fraction = kRestRangeFraction;
  prior.limit_sigma_rad = kLimitSigma_rad;
  prior.prior_information = prior_information_;
  // One or two markers cannot tell the root's place and turn at once.
  prior.prior_root_sigma_m = seen < 3 ? 0.05 : 1.0;
  prior.outlier_m = settings_.outlier_m;
  return prior;
}

// What is left of a prior's covariance was told by markers. It changes with the markers, and slowly with the pose.
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
  prior.outlier_m = kNoOutlier_m;  // a marker tells of its bones however far they are from where it wants them
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
    const bool hangs =
        bones_[b].observability == Observability::BearingOnly || bones_[b].observability == Observability::Descendant;
    pose_.set_swivel_plane(b, hangs ? swivel_planes_.plane(b) : kinematics::SwivelPlane{});
  }
  update_observed_fractions(seen);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const Eigen::Matrix3d& observed_fraction = bones_[b].observed_fraction;
    const Eigen::Matrix3d unobserved_fraction = Eigen::Matrix3d::Identity() - observed_fraction;
    const double some = std::clamp(observed_fraction.trace(), 0.0, 1.0);
    const double unseen_rad = some * kUnobservedAxisSigma_rad + (1.0 - some) * kUnseenJointSigma_rad;
    prior_information_[b] =
        (kMotionSigma_rad * kMotionSigma_rad * observed_fraction + unseen_rad * unseen_rad * unobserved_fraction)
            .inverse();
    const double all = std::max(0.0, 1.0 - unobserved_fraction.trace());
    if (all > kFullyObservedFraction) bones_[b].fully_observed_at = at_;
    const double unobserved_s = std::max(0.0, to_s(at_ - bones_[b].fully_observed_at));
    const double lately = settings_.rest_prior_time_constant_s > 0.0
                              ? some * std::exp(-unobserved_s / settings_.rest_prior_time_constant_s)
                              : 0.0;
    rest_confidence_[b] = 1.0 - (1.0 - kObservedPriorFraction) * std::max(all, lately);
    limit_confidence_[b] = 1.0 - (1.0 - kObservedPriorFraction) * some;
    if (bones_[b].observability == Observability::BearingOnly && is_weakly_observed(b)) {
      rest_confidence_[b] = limit_confidence_[b] = 1.0;
      const double min_sigma_rad = std::min(kBearingOnlySigma_rad, unseen_rad);
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

// Where markers stay off, small steps from the pose at hand may have led into the wrong valley: a limb came out from
// behind the body elsewhere, or is turned the wrong way round. Then all markers pull from afar and limbs are laid on
// theirs anew; the better of both explains. Of the first's cost at most what these markers cost can be saved.
kinematics::PoseFitResult SkeletonTracker::solve(std::span<const kinematics::Observation> seen,
                                                 const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                                                 double max_cost) {
  std::copy(pose_.locals().begin(), pose_.locals().end(), start_pose_.begin());
  const kinematics::PoseFitResult first = pose_.solve(seen, prior, end);
  double off_cost = 0.0;
  for (const kinematics::Observation& one : seen) {
    if (!kinematics::is_usable(one) ||
        kinematics::distance_m(one, pose_.marker_at(static_cast<std::size_t>(one.marker))) < settings_.outlier_m)
      continue;
    off_cost += 0.5 * kinematics::information_1_m2(one) * prior.outlier_m * prior.outlier_m;
  }
  if (off_cost == 0.0 || first.cost - off_cost > max_cost) return first;
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

void SkeletonTracker::commit(std::span<const kinematics::Observation> seen) {
  const double step_s = to_s(at_ - committed_at_);
  const double decay = std::exp(-std::max(0.0, step_s) / kCoastTimeConstant_s);
  // What another body is turned by is no motion.
  const bool motion = step_s > 0.0 && step_s <= kMaxGap_s && !refitted_;
  // Half of the new, half of the old: noise of the pose is halved, a swing is followed within two sets.
  constexpr double kVelocityGain = 0.5;
  if (seen.empty()) {
    velocity_m_s_ *= decay;
  } else if (motion) {
    velocity_m_s_ += kVelocityGain * ((pose_.locals()[0].position - committed_[0].position) / step_s - velocity_m_s_);
  }
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& bone = bones_[b];
    const Eigen::Vector3d coasting_rad_s = decay * bone.angular_velocity_rad_s;
    if (!motion) {
      bone.angular_velocity_rad_s = coasting_rad_s;
    } else {
      const Eigen::Quaterniond& now = pose_.locals()[b].rotation;
      const Eigen::Vector3d turned = kinematics::rotation_vector(now * committed_[b].rotation.conjugate());
      const double innovation_rad = kinematics::rotation_vector(now * predicted_[b].rotation.conjugate()).norm();
      // A limb that was laid anew did not turn: it had been read wrongly.
      const bool was_reinitialised = turned.norm() > kMaxStepRotation_rad || reinitialised_[b] != 0 ||
                                     (bone.observability != Observability::Full && innovation_rad > kMaxInnovation_rad);
      if (was_reinitialised) bone.angular_velocity_rad_s.setZero();
      const Eigen::Vector3d known_rad_s =
          bone.angular_velocity_rad_s + kVelocityGain * (turned / step_s - bone.angular_velocity_rad_s);
      // What was not told before and is now comes from elsewhere, and is no motion.
      const Eigen::Vector3d learnt_rad_s =
          bone.observed_fraction * (bone.previous_observed_fraction * (known_rad_s - coasting_rad_s));
      if (!was_reinitialised) bone.angular_velocity_rad_s = coasting_rad_s + learnt_rad_s;
    }
    bone.previous_observed_fraction = bone.observed_fraction;
    if (b > 0 && !seen.empty()) mean_rotation_.update(b, pose_.locals()[b].rotation, bone.observed_fraction, step_s);
    if (!seen.empty() && hinge_axes_.update(b, pose_.locals()[b].rotation, bone.observed_fraction, step_s))
      pose_.set_hinge_axis(b, hinge_axes_.nominal_from_calibrated(b));
    if (!seen.empty()) swivel_planes_.update(b, pose_.locals()[b].rotation, bone.observed_fraction, step_s);
    joint_drift_.step(b, seen.empty() ? Eigen::Matrix3d::Zero() : bone.observed_fraction, step_s);
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), committed_.begin());
  for (std::size_t m = 0; m < markers_.size(); ++m) {
    const Eigen::Vector3d place = predicted_position(m);
    if (motion) markers_[m].velocity_m_s = (place - markers_[m].position_m) / step_s;
    markers_[m].position_m = place;
  }
  for (const kinematics::Observation& one : seen) {
    if (one.bearing_only || one.is_ambiguous || !kinematics::is_usable(one)) continue;
    const auto m = static_cast<std::size_t>(one.marker);
    MarkerMemory& marker = markers_[m];
    const Pose& world = pose_.world()[static_cast<std::size_t>(pose_.marker_set().markers[m].bone)];
    const Eigen::Vector3d off = world.rotation.conjugate() * (one.position - pose_.marker_at(m));
    if (off.norm() < kMaxBias_m) marker.bias_m += kBiasGain * (off - marker.bias_m);
    marker.seen_at = at_;
    marker.ever_seen = true;
  }
  for (DepthGaussianSum& depth : depth_hypotheses_) depth.commit(at_);
  committed_at_ = at_;
  refitted_ = false;
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
