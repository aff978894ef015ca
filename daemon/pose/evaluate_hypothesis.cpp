// The part of BodyFollower that says what a reading of the markers costs.

#include <algorithm>

#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// How unsure a joint is at first that no marker of its bone tells.
constexpr double kHoldFurther_rad = 0.05;
// To tell readings from each other: their costs differ by far more.
constexpr double kSmallEnough = 5e-3;

}  // namespace

kinematics::PoseFitResult BodyFollower::explain(std::span<const kinematics::Observation> seen, double within) {
  pose_.set_locals(fitted_);
  return explain_at_hand(seen, within);
}

kinematics::PoseFitResult BodyFollower::explain_near(std::span<const Pose> locals, std::span<const Swing> swings,
                                         std::span<const kinematics::Observation> seen, double within) {
  pose_.set_locals(locals);
  for (const Swing& swing : swings) {
    const auto marker = static_cast<std::size_t>(swing.marker);
    const int bone = pose_.marker_set().markers[marker].bone;
    swing_to(static_cast<std::size_t>(bone), marker, pose_.marker_at(static_cast<std::size_t>(swing.onto)));
  }
  return explain_at_hand(seen, within);
}

// Wherever the search begins, joints are held to the last fit.
kinematics::PoseFitResult BodyFollower::explain_at_hand(std::span<const kinematics::Observation> seen, double within) {
  loosen(seen, at_);
  const kinematics::PoseFitEnd end{.max_iterations = 2 * settings_.max_iterations, .small_step = kSmallEnough};
  kinematics::PosePrior prior = prior_of(seen.size());
  prior.hold_from = fitted_;
  return solve(seen, prior, end, within);
}

// From the pose at hand. Where the prior holds joints to another pose they may stay near that one, or have leapt: hands
// do, in recordings and where sets are missing. The better of both explains.
kinematics::PoseFitResult BodyFollower::solve_held_or_loose(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior,
                                                const kinematics::PoseFitEnd& end) {
  std::copy(pose_.locals().begin(), pose_.locals().end(), begun_.begin());
  const kinematics::PoseFitResult held = pose_.solve(seen, prior, end);
  if (prior.hold_from.empty()) return held;
  std::copy(pose_.locals().begin(), pose_.locals().end(), turned_.begin());
  pose_.set_locals(begun_);
  kinematics::PosePrior loose = prior;
  loose.hold_from = {};
  const kinematics::PoseFitResult leapt = pose_.solve(seen, loose, end);
  if (leapt.cost < held.cost) return leapt;
  pose_.set_locals(turned_);
  return held;
}

// How far joints may have turned since they were told.
void BodyFollower::loosen(std::span<const kinematics::Observation> seen, Timestamp at) {
  see_bones(seen);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const double least_rad = bones_[b].told == Told::Direct ? kHold_rad : kHoldFurther_rad;
    // What nothing tells in this instant strays from the last one on.
    const double ahead_s = bones_[b].told == Told::Direct ? 0.0 : to_s(at - learnt_at_);
    hold_weight_[b] = misread_[b] != 0
                          ? Eigen::Matrix3d(Eigen::Matrix3d::Identity() / (kMostStray_rad * kMostStray_rad))
                          : hidden_.hold_weight(b, least_rad, ahead_s);
  }
}

}  // namespace mocap::pose
