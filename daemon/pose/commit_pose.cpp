// SkeletonTracker, continued: what a set leaves for the next one.

#include <algorithm>
#include <cmath>

#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// Gain of the velocity filter: halves the noise of the pose and follows a change of velocity within two sets. Chosen
// by hand; not yet measured.
constexpr double kVelocityGain = 0.5;
// A larger rotation between two sets, or a larger innovation of a joint without an own marker, is a reinitialisation
// and no motion (decision 0010). Chosen by hand; not yet measured.
constexpr double kMaxStepRotation_rad = 0.8;
constexpr double kMaxInnovation_rad = 0.25;
// Gain and bound of the learned marker bias: slow and bounded, so that a wrong label has little effect. Chosen by hand;
// not yet measured.
constexpr double kBiasGain = 0.05;
constexpr double kMaxBias_m = 0.02;

}  // namespace

void SkeletonTracker::commit(std::span<const kinematics::Observation> seen) {
  const double step_s = to_s(at_ - committed_at_);
  // A change of the body model is no motion.
  const bool motion = step_s > 0.0 && step_s <= kMaxGap_s && !refitted_;
  if (motion) interval_.add(step_s);
  commit_velocities(!seen.empty(), motion, step_s);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const BoneMemory& bone = bones_[b];
    joint_drift_.step(b, seen.empty() ? Eigen::Matrix3d::Zero() : bone.observed_fraction, step_s);
    if (!seen.empty()) learn_joint(b, step_s);
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), committed_.begin());
  commit_markers(seen, motion, step_s);
  for (DepthGaussianSum& depth : depth_hypotheses_) depth.commit(at_);
  committed_at_ = at_;
  refitted_ = false;
}

// Velocities of the root and of all joints, from the last committed pose to this one.
void SkeletonTracker::commit_velocities(bool is_seen, bool motion, double step_s) {
  const double decay = std::exp(-std::max(0.0, step_s) / kCoastTimeConstant_s);
  const double gain = kVelocityGain * interval_.gain_factor(step_s);
  if (!is_seen) {
    velocity_m_s_ *= decay;
  } else if (motion) {
    velocity_m_s_ += gain * ((pose_.locals()[0].position - committed_[0].position) / step_s - velocity_m_s_);
  }
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& bone = bones_[b];
    const Eigen::Vector3d coasting_rad_s = decay * bone.angular_velocity_rad_s;
    if (!motion) {
      bone.angular_velocity_rad_s = coasting_rad_s;
    } else {
      const Eigen::Quaterniond& now = pose_.locals()[b].rotation;
      const Eigen::Vector3d rotation_rad = kinematics::rotation_vector(now * committed_[b].rotation.conjugate());
      const double innovation_rad = kinematics::rotation_vector(now * predicted_[b].rotation.conjugate()).norm();
      // A reinitialised limb did not move: its earlier pose was wrong.
      const bool was_reinitialised = rotation_rad.norm() > kMaxStepRotation_rad || reinitialised_[b] != 0 ||
                                     (bone.observability != Observability::Full && innovation_rad > kMaxInnovation_rad);
      if (was_reinitialised) bone.angular_velocity_rad_s.setZero();
      const Eigen::Vector3d filtered_rad_s =
          bone.angular_velocity_rad_s + gain * (rotation_rad / step_s - bone.angular_velocity_rad_s);
      // Velocity is updated only about axes that were observed before and are observed now.
      const Eigen::Vector3d observed_change_rad_s =
          bone.observed_fraction * (bone.previous_observed_fraction * (filtered_rad_s - coasting_rad_s));
      if (!was_reinitialised) bone.angular_velocity_rad_s = coasting_rad_s + observed_change_rad_s;
    }
    bone.previous_observed_fraction = bone.observed_fraction;
  }
}

// Running mean, hinge axis and swivel plane of one joint.
void SkeletonTracker::learn_joint(std::size_t b, double step_s) {
  const Eigen::Quaterniond& rotation = pose_.locals()[b].rotation;
  const Eigen::Matrix3d& observed_fraction = bones_[b].observed_fraction;
  if (b > 0) mean_rotation_.update(b, rotation, observed_fraction, step_s);
  if (hinge_axes_.update(b, rotation, observed_fraction, step_s))
    pose_.set_hinge_axis(b, hinge_axes_.nominal_from_calibrated(b));
  swivel_planes_.update(b, rotation, observed_fraction, step_s);
}

// Positions and velocities of all markers; bias and time of those that were measured.
void SkeletonTracker::commit_markers(std::span<const kinematics::Observation> seen, bool motion, double step_s) {
  const double gain = interval_.gain_factor(step_s);
  for (std::size_t m = 0; m < markers_.size(); ++m) {
    const Eigen::Vector3d position_m = predicted_position(m);
    Eigen::Vector3d& velocity_m_s = markers_[m].velocity_m_s;
    if (motion) velocity_m_s += gain * ((position_m - markers_[m].position_m) / step_s - velocity_m_s);
    markers_[m].position_m = position_m;
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
}

}  // namespace mocap::pose
