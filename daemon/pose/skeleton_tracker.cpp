#include "pose/skeleton_tracker.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// As kHold_rad, of the turns about other axes than those that markers tell: a limb about itself, an elbow that is
// hidden about the line from shoulder to wrist. They follow what the told ones lead to, and nothing drives them.
constexpr double kHoldPart_rad = 0.1;
// The same where one camera's ray is all that tells of a bone's own markers: what it tells is first the turn of the
// bone above, where that is hidden, too, and the bone lies as it commonly does.
constexpr double kHoldRay_rad = 0.05;
// What joints commonly do is believed so much where markers tell how a joint is turned: a marker on skin of 3 mm, 6 cm
// from the joint's axis, tells a turn to 3 degrees, and what is common must not move that by more than a tenth of a
// degree, even a radian beyond.
constexpr double kShareTold = 0.05;
// Markers that tell so much of a joint's turn tell it whole.
constexpr double kAlmostAll = 0.8;
// Steps under this leave less than a twentieth of a degree to be found: a step's square, and a share of what markers
// are off.
constexpr double kSmallStep = 5e-4;
// Of a joint that no marker moves: it stays, and goes back to rest within seconds.
constexpr double kHoldUnseen_rad = 0.02;
// How hard a joint's range is: people reach beyond it by a little, markers that are seen are believed more.
constexpr double kLimit_rad = 0.3;
// A joint's rest as a share of its range: collar bones (20 degrees) stay within 10, elbows where they are.
constexpr double kRestShare = 0.5;
// Motion that nobody sees dies away with this time constant, and a joint goes back to how it usually is with the
// other. People's shoulders, elbows, hips and knees over 0.05 to 0.5 s: 0.05 to 0.1 s and 0.5 s lead nearest.
constexpr double kCoast_s = 0.1;
constexpr double kBack_s = 0.5;
// A gap in the sets after which velocities mean nothing; and how far ahead a straight line says anything.
constexpr double kLongGap_s = 0.25;
// How surely a marker is where the body puts it: skin, and the fit.
constexpr double kSkin_m = 0.005;
constexpr double kInJoint_m = 1e-3;
// What a marker is off its place is learnt slowly and within bounds, so that a wrong one does not get into it.
constexpr double kLearnOff = 0.05;
constexpr double kMostOff_m = 0.02;
// So far off a marker still pulls on its bone when others lead nowhere.
constexpr double kFromAfar_m = 0.3;
constexpr double kAnywhere_m = 1e3;
// So many fits by the same markers share one weighing of what they tell.
constexpr int kWeighEvery = 8;
// Nobody turns a joint by more between two sets; or, where its bone's own markers are hidden, against its motion.
constexpr double kMostTurn_rad = 0.8;
constexpr double kMostAstray_rad = 0.25;
constexpr double kNever_s = 1e3;

}  // namespace

BodyFollower::BodyFollower(const MarkerSet& set, const FollowSettings& settings)
    : settings_(settings),
      pose_(set, kinematics::PoseFit::Lengths::Fixed),
      layer_(set),
      hidden_(set.skeleton.bones.size()),
      usual_(set.skeleton.bones.size()),
      leans_(set.skeleton),
      planes_(set.skeleton) {
  const std::size_t bones = set.skeleton.bones.size();
  bones_.resize(bones);
  markers_.resize(set.markers.size());
  depths_.resize(set.markers.size());
  for (const Bone& bone : set.skeleton.bones)
    depth_.push_back(bone.parent < 0 ? 0 : depth_[static_cast<std::size_t>(bone.parent)] + 1);
  learnt_.resize(bones);
  predicted_.resize(bones);
  fitted_.resize(bones);
  begun_.resize(bones);
  tried_.resize(bones);
  turned_.resize(bones);
  unbent_.resize(bones);
  below_.resize(bones);
  held_.resize(bones);
  off_m2_.resize(bones);
  seen_of_.resize(bones);
  for (auto* believed : {&rest_believed_, &limit_believed_, &unheld_rest_, &unheld_limit_}) believed->resize(bones);
  for (auto* weight : {&hold_weight_, &unheld_weight_}) weight->resize(bones);
  weighed_.reserve(2 * set.markers.size());
  misread_.resize(bones);
  bent_back_.resize(bones);
  pairs_.reserve(set.markers.size() + 1);  // and a joint
}

void BodyFollower::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                         std::span<const Eigen::Vector3d> marker_offsets_m) {
  pose_.refit(rest_offsets_m, marker_offsets_m);
  for (MarkerMemory& marker : markers_) marker.off_m.setZero();
  weighed_for_ = kWeighEvery;
  refitted_ = true;
}

void BodyFollower::forget() {
  following_ = false;
  weighed_for_ = kWeighEvery;
  for (MarkerMemory& marker : markers_) marker.ever_seen = false;
}

void BodyFollower::forget_joints() {
  leans_.reset();
  planes_.reset();
  for (std::size_t b = 0; b < bones_.size(); ++b) pose_.lean(b, leans_.as_in_file(b));
}

// The rest pose laid on what was seen, the trunk's markers most, then bent to fit.
bool BodyFollower::start(std::span<const kinematics::Observation> seen, Timestamp at) {
  forget();
  pairs_.clear();
  pose_.place({});
  for (const kinematics::Observation& one : seen) {
    if (one.ray || !kinematics::is_usable(one)) continue;
    const auto m = static_cast<std::size_t>(one.marker);
    const int depth = depth_[static_cast<std::size_t>(pose_.marker_set().markers[m].bone)];
    pairs_.push_back({pose_.marker_at(m), one.position, std::pow(0.2, depth)});
  }
  const std::optional<geometry::RigidFit> laid = geometry::fit_rigid(pairs_);
  if (!laid) return false;
  pose_.place(laid->to_from);
  const int patience = 5 * settings_.max_iterations;
  (void)pose_.solve(seen, {.rest_share = kRestShare, .outlier_m = 0.5}, patience);
  const kinematics::PosePrior prior{.rest_share = kRestShare, .outlier_m = settings_.outlier_m};
  kinematics::PoseFitResult result = pose_.solve(seen, prior, patience);
  // From the rest pose a body that is bent far may be led astray; laid bone by bone it is not. The better of both.
  std::copy(pose_.locals().begin(), pose_.locals().end(), tried_.begin());
  if (layer_.lay(pose_.marker_set(), seen, turned_)) {
    pose_.set_locals(turned_);
    const kinematics::PoseFitResult laid_anew = pose_.solve(seen, prior, patience);
    if (laid_anew.cost < result.cost) {
      result = laid_anew;
    } else {
      pose_.set_locals(tried_);
    }
  }
  residual_m_ = result.rms_m;
  velocity_m_s_.setZero();
  see_bones(seen);
  hidden_.reset();
  usual_.reset();
  for (BoneMemory& bone : bones_) {
    bone.spin_rad_s.setZero();
    bone.whole_at = at - from_s(kNever_s);
  }
  for (const kinematics::Observation& one : seen) {
    if (one.ray || !kinematics::is_usable(one)) continue;
    MarkerMemory& marker = markers_[static_cast<std::size_t>(one.marker)];
    marker = {at, true, Eigen::Vector3d::Zero(), one.position, Eigen::Vector3d::Zero()};
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), learnt_.begin());
  std::copy(learnt_.begin(), learnt_.end(), predicted_.begin());
  learnt_at_ = at_ = at;
  following_ = true;
  refitted_ = false;
  return true;
}

void BodyFollower::predict(Timestamp at) {
  at_ = at;
  std::fill(misread_.begin(), misread_.end(), 0);
  std::fill(bent_back_.begin(), bent_back_.end(), 0);
  const double ahead_s = std::clamp(to_s(at - learnt_at_), 0.0, kLongGap_s);
  // The way that a speed which dies away leads to.
  const double dying_s = kCoast_s * (1.0 - std::exp(-ahead_s / kCoast_s));
  const double back = 1.0 - std::exp(-ahead_s / kBack_s);
  std::copy(learnt_.begin(), learnt_.end(), predicted_.begin());
  predicted_[0].position += ahead_s * velocity_m_s_;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const BoneMemory& bone = bones_[b];
    Eigen::Vector3d turn = dying_s * bone.spin_rad_s + (ahead_s - dying_s) * (bone.share * bone.spin_rad_s);
    const Eigen::Vector3d to_usual = usual_.turn_from(b, predicted_[b].rotation);
    turn += back * (to_usual - bone.share * to_usual);
    if (turn.isZero()) continue;
    predicted_[b].rotation = (kinematics::turn_by(turn) * predicted_[b].rotation).normalized();
  }
  pose_.set_locals(predicted_);
}

void BodyFollower::see_bones(std::span<const kinematics::Observation> seen) {
  const MarkerSet& set = pose_.marker_set();
  for (BoneMemory& bone : bones_) bone.told = Told::No;
  for (const kinematics::Observation& one : seen) {
    if (!kinematics::is_usable(one)) continue;
    const MarkerOnBone& marker = set.markers[static_cast<std::size_t>(one.marker)];
    const bool in_joint = marker.offset_m.norm() < kInJoint_m;
    int bone = marker.bone;
    if (in_joint) bone = set.skeleton.bones[static_cast<std::size_t>(bone)].parent;
    if (bone >= 0) {
      Told& told = bones_[static_cast<std::size_t>(bone)].told;
      told = std::max(told, one.ray ? Told::Ray : Told::Direct);
    }
    while (bone >= 0) {
      BoneMemory& above = bones_[static_cast<std::size_t>(bone)];
      if (above.told == Told::No) above.told = Told::Further;
      bone = set.skeleton.bones[static_cast<std::size_t>(bone)].parent;
    }
  }
}

kinematics::PosePrior BodyFollower::prior_of(std::size_t seen) const {
  kinematics::PosePrior prior;
  prior.rest_share = kRestShare;
  prior.limit_sigma_rad = kLimit_rad;
  prior.hold_weight = hold_weight_;
  // One or two markers cannot tell the root's place and turn at once.
  prior.hold_root_sigma_m = seen < 3 ? 0.05 : 1.0;
  prior.outlier_m = settings_.outlier_m;
  return prior;
}

// What is left of a prior's covariance was told by markers. It changes with the markers, and slowly with the pose.
void BodyFollower::weigh_turns(std::span<const kinematics::Observation> seen) {
  const auto same = [](const kinematics::Observation& one, const Weighed& was) {
    return one.marker == was.marker && one.ray == was.ray && kinematics::is_usable(one) == was.usable;
  };
  if (weighed_for_ < kWeighEvery && std::equal(seen.begin(), seen.end(), weighed_.begin(), weighed_.end(), same)) {
    ++weighed_for_;
    return;
  }
  weighed_for_ = 1;
  weighed_.clear();
  for (const kinematics::Observation& one : seen) weighed_.push_back({one.marker, one.ray, kinematics::is_usable(one)});
  std::fill(hold_weight_.begin(), hold_weight_.end(),
            Eigen::Matrix3d::Identity() / (settings_.told_rad * settings_.told_rad));
  std::fill(rest_believed_.begin(), rest_believed_.end(), 0.0);
  kinematics::PosePrior prior = prior_of(seen.size());
  prior.rest_believed = rest_believed_;
  prior.limit_believed = rest_believed_;
  prior.outlier_m = kAnywhere_m;  // a marker tells of its bones however far they are from where it wants them
  const bool told = pose_.weigh(seen, prior);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    bones_[b].share.setZero();
    if (told)
      bones_[b].share =
          Eigen::Matrix3d::Identity() - pose_.local_covariance(b) / (settings_.told_rad * settings_.told_rad);
  }
}

kinematics::PoseFitResult BodyFollower::fit(std::span<const kinematics::Observation> seen) {
  pose_.set_locals(predicted_);
  see_bones(seen);
  if (seen.empty()) return {};
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const bool hangs = bones_[b].told == Told::Ray || bones_[b].told == Told::Further;
    pose_.bend_in(b, hangs ? planes_.plane(b) : kinematics::BendingPlane{});
  }
  weigh_turns(seen);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const Eigen::Matrix3d& told = bones_[b].share;
    const Eigen::Matrix3d untold = Eigen::Matrix3d::Identity() - told;
    const double some = std::clamp(told.trace(), 0.0, 1.0);
    const double unseen_rad = some * kHoldPart_rad + (1.0 - some) * kHoldUnseen_rad;
    hold_weight_[b] = (kHold_rad * kHold_rad * told + unseen_rad * unseen_rad * untold).inverse();
    const double all = std::max(0.0, 1.0 - untold.trace());
    if (all > kAlmostAll) bones_[b].whole_at = at_;
    const double hidden_s = std::max(0.0, to_s(at_ - bones_[b].whole_at));
    const double lately = settings_.remembered_s > 0.0 ? some * std::exp(-hidden_s / settings_.remembered_s) : 0.0;
    rest_believed_[b] = 1.0 - (1.0 - kShareTold) * std::max(all, lately);
    limit_believed_[b] = 1.0 - (1.0 - kShareTold) * some;
    if (bones_[b].told == Told::Ray && hangs_free(b)) {
      rest_believed_[b] = limit_believed_[b] = 1.0;
      const double least_rad = std::min(kHoldRay_rad, unseen_rad);
      hold_weight_[b] = (kHoldRay_rad * kHoldRay_rad * told + least_rad * least_rad * untold).inverse();
    }
    if (misread_[b] != 0) hold_weight_[b] = Eigen::Matrix3d::Identity() / (kMostStray_rad * kMostStray_rad);
  }
  kinematics::PosePrior prior = prior_of(seen.size());
  prior.rest_believed = rest_believed_;
  prior.limit_believed = limit_believed_;
  const kinematics::PoseFitEnd end{.max_iterations = settings_.max_iterations, .small_step = kSmallStep};
  const kinematics::PoseFitResult result = cross_over(seen, prior, end, bend_back(seen, prior, end, solve(seen, prior, end)));
  residual_m_ = result.rms_m;
  std::copy(pose_.locals().begin(), pose_.locals().end(), fitted_.begin());
  return result;
}

// Where markers stay off, small steps from the pose at hand may have led into the wrong valley: a limb came out from
// behind the body elsewhere, or is turned the wrong way round. Then all markers pull from afar and limbs are laid on
// theirs anew; the better of both explains. Of the first's cost at most what these markers cost can be saved.
kinematics::PoseFitResult BodyFollower::solve(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                                  double within) {
  std::copy(pose_.locals().begin(), pose_.locals().end(), begun_.begin());
  const kinematics::PoseFitResult first = pose_.solve(seen, prior, end);
  double off_cost = 0.0;
  for (const kinematics::Observation& one : seen) {
    if (!kinematics::is_usable(one) || kinematics::off_m(one, pose_.marker_at(static_cast<std::size_t>(one.marker))) < settings_.outlier_m)
      continue;
    off_cost += 0.5 * kinematics::information_1_m2(one) * prior.outlier_m * prior.outlier_m;
  }
  if (off_cost == 0.0 || first.cost - off_cost > within) return first;
  std::copy(pose_.locals().begin(), pose_.locals().end(), tried_.begin());
  pose_.set_locals(begun_);
  kinematics::PosePrior wide = prior;
  wide.outlier_m = kFromAfar_m;
  (void)pose_.solve(seen, wide, {.max_iterations = 2 * end.max_iterations, .small_step = end.small_step});
  (void)turn_anew(seen);
  const kinematics::PoseFitResult second = solve_held_or_loose(seen, prior, end);
  if (second.cost < first.cost) return second;
  pose_.set_locals(tried_);
  return first;
}

void BodyFollower::learn(std::span<const kinematics::Observation> seen) {
  const double step_s = to_s(at_ - learnt_at_);
  const double left = std::exp(-std::max(0.0, step_s) / kCoast_s);
  // What another body is turned by is no motion.
  const bool motion = step_s > 0.0 && step_s <= kLongGap_s && !refitted_;
  // Half of the new, half of the old: noise of the pose is halved, a swing is followed within two sets.
  constexpr double kNew = 0.5;
  if (seen.empty()) {
    velocity_m_s_ *= left;
  } else if (motion) {
    velocity_m_s_ += kNew * ((pose_.locals()[0].position - learnt_[0].position) / step_s - velocity_m_s_);
  }
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& bone = bones_[b];
    const Eigen::Vector3d dying_rad_s = left * bone.spin_rad_s;
    if (!motion) {
      bone.spin_rad_s = dying_rad_s;
    } else {
      const Eigen::Quaterniond& now = pose_.locals()[b].rotation;
      const Eigen::Vector3d turned = kinematics::rotation_vector(now * learnt_[b].rotation.conjugate());
      const double astray_rad = kinematics::rotation_vector(now * predicted_[b].rotation.conjugate()).norm();
      // A limb that was laid anew did not turn: it had been read wrongly.
      const bool laid_anew = turned.norm() > kMostTurn_rad || bent_back_[b] != 0 ||
                             (bone.told != Told::Direct && astray_rad > kMostAstray_rad);
      if (laid_anew) bone.spin_rad_s.setZero();
      const Eigen::Vector3d known_rad_s = bone.spin_rad_s + kNew * (turned / step_s - bone.spin_rad_s);
      // What was not told before and is now comes from elsewhere, and is no motion.
      const Eigen::Vector3d learnt_rad_s = bone.share * (bone.share_before * (known_rad_s - dying_rad_s));
      if (!laid_anew) bone.spin_rad_s = dying_rad_s + learnt_rad_s;
    }
    bone.share_before = bone.share;
    if (b > 0 && !seen.empty()) usual_.learn(b, pose_.locals()[b].rotation, bone.share, step_s);
    if (!seen.empty() && leans_.learn(b, pose_.locals()[b].rotation, bone.share, step_s))
      pose_.lean(b, leans_.as_in_file(b));
    if (!seen.empty()) planes_.learn(b, pose_.locals()[b].rotation, bone.share, step_s);
    hidden_.step(b, seen.empty() ? Eigen::Matrix3d::Zero() : bone.share, step_s);
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), learnt_.begin());
  for (std::size_t m = 0; m < markers_.size(); ++m) {
    const Eigen::Vector3d place = told(m);
    if (motion) markers_[m].moved_m_s = (place - markers_[m].place_m) / step_s;
    markers_[m].place_m = place;
  }
  for (const kinematics::Observation& one : seen) {
    if (one.ray || one.surmised || !kinematics::is_usable(one)) continue;
    const auto m = static_cast<std::size_t>(one.marker);
    MarkerMemory& marker = markers_[m];
    const Pose& world = pose_.world()[static_cast<std::size_t>(pose_.marker_set().markers[m].bone)];
    const Eigen::Vector3d off = world.rotation.conjugate() * (one.position - pose_.marker_at(m));
    if (off.norm() < kMostOff_m) marker.off_m += kLearnOff * (off - marker.off_m);
    marker.seen_at = at_;
    marker.ever_seen = true;
  }
  for (RayDepth& depth : depths_) depth.learn(at_);
  learnt_at_ = at_;
  refitted_ = false;
}

Eigen::Vector3d BodyFollower::told(std::size_t marker) const {
  const auto bone = static_cast<std::size_t>(pose_.marker_set().markers[marker].bone);
  return pose_.marker_at(marker) + pose_.world()[bone].rotation * markers_[marker].off_m;
}

double BodyFollower::unseen_s(std::size_t marker, Timestamp at) const {
  return markers_[marker].ever_seen ? std::max(0.0, to_s(at - markers_[marker].seen_at)) : kNever_s;
}

bool BodyFollower::weigh(std::span<const kinematics::Observation> seen, Timestamp at) {
  loosen(seen, at);
  kinematics::PosePrior prior = prior_of(3);
  prior.hold_root_sigma_m = seen.empty() ? 0.1 : 1.0;
  return pose_.weigh(seen, prior);
}

Eigen::Matrix3d BodyFollower::told_covariance(std::size_t marker) const {
  return pose_.covariance_of(marker) + kSkin_m * kSkin_m * Eigen::Matrix3d::Identity();
}

}  // namespace mocap::pose
