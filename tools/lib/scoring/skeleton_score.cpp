#include "lib/scoring/skeleton_score.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace mocap::scoring {
namespace {

std::optional<double> rms(double squares, std::uint64_t count, double unit) {
  if (count == 0) return std::nullopt;
  return unit * std::sqrt(squares / static_cast<double>(count));
}

}  // namespace

std::optional<double> SkeletonCounts::joint_rms_mm() const { return rms(squares_m2, joints, 1000.0); }
std::optional<double> SkeletonCounts::rotation_rms_deg() const {
  return rms(rotation_squares_rad2, joints, 180.0 / std::numbers::pi);
}
std::optional<double> SkeletonCounts::rotation_observable_deg() const {
  return rms(std::max(0.0, rotation_squares_rad2 - unobservable_squares_rad2), joints - unobservable,
             180.0 / std::numbers::pi);
}
std::optional<double> SkeletonCounts::rotation_unobservable_deg() const {
  return rms(unobservable_squares_rad2, unobservable, 180.0 / std::numbers::pi);
}
std::optional<double> SkeletonCounts::hidden_joint_rms_mm() const {
  return rms(hidden_squares_m2, hidden_joints, 1000.0);
}
std::optional<double> SkeletonCounts::jitter_mm() const {
  return rms(jitter_squares_m2, 3 * jitters, 1000.0 / std::sqrt(6.0));
}

std::optional<double> BoneCounts::joint_rms_mm() const { return rms(squares_m2, sets, 1000.0); }
std::optional<double> BoneCounts::rotation_rms_deg() const {
  return rms(rotation_squares_rad2, sets, 180.0 / std::numbers::pi);
}

void SkeletonCounts::add(const SkeletonCounts& other) {
  sets += other.sets;
  joints += other.joints;
  squares_m2 += other.squares_m2;
  max_m = std::max(max_m, other.max_m);
  rotation_squares_rad2 += other.rotation_squares_rad2;
  unobservable += other.unobservable;
  unobservable_squares_rad2 += other.unobservable_squares_rad2;
  hidden_joints += other.hidden_joints;
  hidden_squares_m2 += other.hidden_squares_m2;
  jitters += other.jitters;
  jitter_squares_m2 += other.jitter_squares_m2;
}

void SkeletonScorer::add(const EvalFrame& truth, const EvalFrame& reported) {
  if (!begun_at_) begun_at_ = reported.exposed_at;
  ++set_;
  auto own = truth.bones.begin();
  const auto name = [](const PosedBone& b) { return std::pair(b.subject, b.bone); };
  std::optional<std::uint32_t> subject;
  SkeletonCounts one;
  const auto close = [&] {
    if (!subject || one.joints == 0) return;
    one.sets = 1;
    counts_[*subject].add(one);
    if (keeps_errors_) {
      errors_[*subject].push_back(
          {to_s(reported.exposed_at - *begun_at_), one.joint_rms_mm().value_or(0.0), 1000.0 * one.max_m});
    }
  };
  for (const PosedBone& bone : reported.bones) {
    while (own != truth.bones.end() && name(*own) < name(bone)) ++own;
    if (own == truth.bones.end()) break;
    if (name(*own) != name(bone)) continue;
    if (subject != bone.subject) {
      close();
      subject = bone.subject;
      one = {};
    }
    judge(bone, *own, one);
  }
  close();
}

bool SkeletonScorer::is_observable(const PosedBone& bone) const {
  return bone.subject >= observable_.size() || bone.bone >= observable_[bone.subject].size() ||
         observable_[bone.subject][bone.bone];
}

void SkeletonScorer::judge(const PosedBone& reported, const PosedBone& own, SkeletonCounts& counts) {
  const Eigen::Vector3d off_m = reported.position_m - own.position_m;
  const double turned_rad = reported.rotation.angularDistance(own.rotation);
  ++counts.joints;
  counts.squares_m2 += off_m.squaredNorm();
  counts.max_m = std::max(counts.max_m, off_m.norm());
  counts.rotation_squares_rad2 += turned_rad * turned_rad;
  if (!is_observable(reported)) {
    ++counts.unobservable;
    counts.unobservable_squares_rad2 += turned_rad * turned_rad;
  }
  BoneCounts& bone = bones_[reported.subject][reported.bone];
  ++bone.sets;
  bone.squares_m2 += off_m.squaredNorm();
  bone.rotation_squares_rad2 += turned_rad * turned_rad;
  if (own.state == BoneState::Filled) {
    ++counts.hidden_joints;
    counts.hidden_squares_m2 += off_m.squaredNorm();
  }
  Past& past = past_[{reported.subject, reported.bone}];
  if (past.known > 0 && past.set + 1 != set_) past.known = 0;
  if (past.known >= 2) {
    ++counts.jitters;
    counts.jitter_squares_m2 += (off_m - 2.0 * past.last + past.before).squaredNorm();
  }
  past.before = past.last;
  past.last = off_m;
  past.set = set_;
  past.known = std::min(2, past.known + 1);
}

}  // namespace mocap::scoring
