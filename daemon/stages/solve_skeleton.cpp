#include "stages/solve_skeleton.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "base/expects.h"
#include "body/pose_fit.h"
#include "body/rotation.h"
#include "geometry/rigid_fit.h"

namespace mocap::stages {
namespace {

using body::Observation;
using body::PoseFit;

// A person's joint hardly turns by more than this from set to set against what its motion lets expect, rad.
constexpr double kHoldSeen_rad = 0.3;
// Of a joint that no marker moves: it stays, and goes back to rest within seconds.
constexpr double kHoldUnseen_rad = 0.02;
// Motion that nobody sees dies away with this time constant.
constexpr double kCoast_s = 0.15;
// A gap in the sets after which velocities mean nothing.
constexpr double kLongGap_s = 0.25;
// How uncertain a place that the body tells is, at once and by the second that nobody saw it; bounded to an arm's
// swing.
constexpr double kToldSigma_m = 0.008;
constexpr double kToldGrowth_m_s = 0.4;
constexpr double kToldMost_m = 0.15;

struct MarkerMemory {
  Timestamp seen_at;
  bool ever_seen = false;
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();  // from where the body puts it, in its bone's frame
};

struct BoneMemory {
  Eigen::Vector3d spin_rad_s = Eigen::Vector3d::Zero();  // of the local turn, in the parent's frame
  Timestamp seen_at;
  Eigen::Quaterniond shown_world = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond shown_local = Eigen::Quaterniond::Identity();
};

class OneSubject {
 public:
  OneSubject(const SolveSettings& settings, const Subject& subject);

  void solve(SubjectLabels& labels, Timestamp at, SubjectPose& into);
  void refit(const SubjectFit& fit);
  void predict(SubjectId id, Timestamp at, Expected& into);

 private:
  void gather(const SubjectLabels& labels, Timestamp at);
  bool start(Timestamp at);
  void follow(Timestamp at);
  void advance(double by_s);
  void learn(std::span<const Pose> before, double step_s);
  void show(Timestamp at, SubjectPose& into);
  bool bone_seen(std::size_t bone) const;
  void fill(SubjectLabels& labels, Timestamp at);
  Eigen::Vector3d told(std::size_t marker, const PoseFit& pose) const;
  double told_sigma(std::size_t marker, Timestamp at) const;

  SolveSettings settings_;
  PoseFit pose_;
  PoseFit ahead_;  // scratch of predict
  bool tracking_ = false;
  Timestamp at_;
  double residual_m_ = 0.0;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
  std::vector<BoneMemory> bones_;
  std::vector<MarkerMemory> markers_;
  std::vector<int> own_markers_;   // by bone
  std::vector<int> seen_markers_;  // by bone, in this set
  std::vector<int> depth_;         // by bone
  std::vector<bool> moved_by_;     // by bone: a marker of it or below it was seen in this set
  std::vector<Observation> seen_;
  std::vector<geometry::PointPair> pairs_;
  std::vector<double> hold_;
  std::vector<Pose> locals_;
  std::vector<Pose> before_;
};

OneSubject::OneSubject(const SolveSettings& settings, const Subject& subject)
    : settings_(settings),
      pose_(subject.marker_set, PoseFit::Lengths::Fixed),
      ahead_(subject.marker_set, PoseFit::Lengths::Fixed) {
  const auto& bones = subject.marker_set.skeleton.bones;
  MOCAP_EXPECTS(bones.size() <= kMaxBones && subject.marker_set.markers.size() <= kMaxLabels);
  bones_.resize(bones.size());
  markers_.resize(subject.marker_set.markers.size());
  own_markers_.resize(bones.size());
  for (const MarkerOnBone& marker : subject.marker_set.markers) ++own_markers_[static_cast<std::size_t>(marker.bone)];
  for (const Bone& bone : bones)
    depth_.push_back(bone.parent < 0 ? 0 : depth_[static_cast<std::size_t>(bone.parent)] + 1);
  seen_markers_.resize(bones.size());
  moved_by_.resize(bones.size());
  seen_.reserve(markers_.size());
  pairs_.reserve(markers_.size());
  hold_.resize(bones.size());
  locals_.resize(bones.size());
  before_.resize(bones.size());
}

void OneSubject::refit(const SubjectFit& fit) {
  pose_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
  ahead_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
  for (MarkerMemory& marker : markers_) marker.off_m.setZero();
}

void OneSubject::gather(const SubjectLabels& labels, Timestamp at) {
  seen_.clear();
  std::fill(seen_markers_.begin(), seen_markers_.end(), 0);
  std::fill(moved_by_.begin(), moved_by_.end(), false);
  const MarkerSet& set = pose_.marker_set();
  for (std::size_t m = 0; m < labels.markers.size() && m < markers_.size(); ++m) {
    const LabelledMarker& label = labels.markers[m];
    if (label.state != LabelState::Measured || !label.position.v.allFinite()) continue;
    const double noise = std::clamp(label.covariance_m2.trace() / 3.0, 0.0, 1.0);
    const double sigma =
        std::sqrt(settings_.marker_sigma_m * settings_.marker_sigma_m + (std::isfinite(noise) ? noise : 1.0));
    seen_.push_back({static_cast<int>(m), label.position.v, sigma});
    markers_[m].seen_at = at;
    markers_[m].ever_seen = true;
    ++seen_markers_[static_cast<std::size_t>(set.markers[m].bone)];
  }
  for (std::size_t b = set.skeleton.bones.size(); b-- > 0;) {
    if (seen_markers_[b] > 0) moved_by_[b] = true;
    if (moved_by_[b] && set.skeleton.bones[b].parent >= 0)
      moved_by_[static_cast<std::size_t>(set.skeleton.bones[b].parent)] = true;
    if (moved_by_[b]) bones_[b].seen_at = at;
  }
}

// A first pose: the rest pose laid on what was seen, the trunk's markers most, then bent to fit.
bool OneSubject::start(Timestamp at) {
  pairs_.clear();
  pose_.place({});
  const MarkerSet& set = pose_.marker_set();
  for (const Observation& one : seen_) {
    const auto m = static_cast<std::size_t>(one.marker);
    const int depth = depth_[static_cast<std::size_t>(set.markers[m].bone)];
    pairs_.push_back({pose_.marker_at(m), one.position, std::pow(0.2, depth)});
  }
  const std::optional<geometry::RigidFit> laid = geometry::fit_rigid(pairs_);
  if (!laid) return false;
  pose_.place(laid->to_from);
  const int patience = 5 * settings_.max_iterations;
  (void)pose_.solve(seen_, {.outlier_m = 0.5}, patience);
  residual_m_ = pose_.solve(seen_, {.outlier_m = settings_.outlier_m}, patience).rms_m;
  velocity_m_s_.setZero();
  for (BoneMemory& bone : bones_) {
    bone.spin_rad_s.setZero();
    bone.seen_at = at;
  }
  return true;
}

// The pose goes on as it moved.
void OneSubject::advance(double by_s) {
  std::copy(pose_.locals().begin(), pose_.locals().end(), locals_.begin());
  locals_[0].position += by_s * velocity_m_s_;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    locals_[b].rotation = (body::turn_by(by_s * bones_[b].spin_rad_s) * locals_[b].rotation).normalized();
  }
  pose_.set_locals(locals_);
}

void OneSubject::follow(Timestamp at) {
  const double step_s = std::clamp(to_s(at - at_), 0.0, kLongGap_s);
  std::copy(pose_.locals().begin(), pose_.locals().end(), before_.begin());
  const double left = std::exp(-step_s / kCoast_s);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    hold_[b] = moved_by_[b] ? kHoldSeen_rad : kHoldUnseen_rad;
    if (!moved_by_[b]) bones_[b].spin_rad_s *= left;
  }
  if (seen_.empty()) velocity_m_s_ *= left;
  advance(step_s);
  if (seen_.empty()) return;
  // One or two markers cannot tell the root's place and turn at once.
  const double root_sigma = seen_.size() < 3 ? 0.05 : 1.0;
  residual_m_ =
      pose_
          .solve(seen_, {.hold_sigma_rad = hold_, .hold_root_sigma_m = root_sigma, .outlier_m = settings_.outlier_m},
                 settings_.max_iterations)
          .rms_m;
  learn(before_, step_s);
}

void OneSubject::learn(std::span<const Pose> before, double step_s) {
  if (step_s <= 0.0) return;
  // Half of the new, half of the old: noise of the pose is halved, a swing is followed within two sets.
  constexpr double kNew = 0.5;
  const Eigen::Vector3d moved = (pose_.locals()[0].position - before[0].position) / step_s;
  velocity_m_s_ += kNew * (moved - velocity_m_s_);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    if (!moved_by_[b]) continue;
    const Eigen::Quaterniond turn = pose_.locals()[b].rotation * before[b].rotation.conjugate();
    bones_[b].spin_rad_s += kNew * (body::rotation_vector(turn) / step_s - bones_[b].spin_rad_s);
  }
}

// Half of a bone's own markers tell it; a bone without any is told by its neighbours.
bool OneSubject::bone_seen(std::size_t bone) const {
  if (own_markers_[bone] > 0) return 2 * seen_markers_[bone] >= own_markers_[bone];
  const auto& bones = pose_.marker_set().skeleton.bones;
  const int parent = bones[bone].parent;
  return parent >= 0 && seen_markers_[static_cast<std::size_t>(parent)] > 0 && moved_by_[bone];
}

void OneSubject::show(Timestamp at, SubjectPose& into) {
  into.residual_m = residual_m_;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& memory = bones_[b];
    memory.shown_world = body::same_side(pose_.world()[b].rotation, memory.shown_world);
    memory.shown_local = body::same_side(pose_.locals()[b].rotation, memory.shown_local);
    BonePose& bone = into.bones.push_back({});
    bone.world_from_bone = {pose_.world()[b].position, memory.shown_world};
    bone.parent_from_bone = {pose_.locals()[b].position, memory.shown_local};
    bone.state = bone_seen(b) ? BoneState::Measured : BoneState::Filled;
    const double unseen_s = to_s(at - memory.seen_at);
    const double share = own_markers_[b] > 0 ? static_cast<double>(seen_markers_[b]) / own_markers_[b] : 1.0;
    const double sure =
        bone.state == BoneState::Measured ? 0.5 + 0.5 * std::min(1.0, share) : 0.5 * std::exp(-unseen_s);
    bone.confidence = static_cast<float>(sure);
  }
}

Eigen::Vector3d OneSubject::told(std::size_t marker, const PoseFit& pose) const {
  const auto bone = static_cast<std::size_t>(pose.marker_set().markers[marker].bone);
  return pose.marker_at(marker) + pose.world()[bone].rotation * markers_[marker].off_m;
}

double OneSubject::told_sigma(std::size_t marker, Timestamp at) const {
  const double unseen_s = markers_[marker].ever_seen ? std::max(0.0, to_s(at - markers_[marker].seen_at)) : 1.0;
  return std::min(kToldMost_m, kToldSigma_m + residual_m_ + kToldGrowth_m_s * unseen_s);
}

void OneSubject::fill(SubjectLabels& labels, Timestamp at) {
  for (std::size_t m = 0; m < labels.markers.size() && m < markers_.size(); ++m) {
    LabelledMarker& label = labels.markers[m];
    const auto bone = static_cast<std::size_t>(pose_.marker_set().markers[m].bone);
    const Pose& world = pose_.world()[bone];
    if (label.state == LabelState::Measured) {
      // Slowly, so that noise does not get into it; bounded, so that a wrong marker does not either.
      const Eigen::Vector3d off = world.rotation.conjugate() * (label.position.v - pose_.marker_at(m));
      if (off.norm() < settings_.outlier_m) markers_[m].off_m += 0.2 * (off - markers_[m].off_m);
      continue;
    }
    const double unseen_s = to_s(at - markers_[m].seen_at);
    if (!markers_[m].ever_seen || unseen_s > settings_.fill_for_s) {
      label.state = LabelState::Lost;
      label.confidence = 0.0F;
      continue;
    }
    const double sigma = told_sigma(m, at);
    label.state = LabelState::Filled;
    label.position.v = told(m, pose_);
    label.covariance_m2 = sigma * sigma * Eigen::Matrix3d::Identity();
    label.residual_px = 0.0;
    label.cameras = 0;
    label.confidence = static_cast<float>(0.8 * std::exp(-unseen_s));
  }
}

void OneSubject::solve(SubjectLabels& labels, Timestamp at, SubjectPose& into) {
  into.bones.clear();
  into.residual_m = 0.0;
  if (labels.phase != SubjectPhase::Tracking) {
    tracking_ = false;
    for (MarkerMemory& marker : markers_) marker.ever_seen = false;
    return;
  }
  gather(labels, at);
  if (!tracking_ || at < at_) {
    tracking_ = start(at);
  } else {
    follow(at);
  }
  at_ = at;
  if (!tracking_) return;
  show(at, into);
  fill(labels, at);
}

void OneSubject::predict(SubjectId id, Timestamp at, Expected& into) {
  if (!tracking_) return;
  // Beyond this a straight line says nothing about a person.
  const double ahead_s = std::clamp(to_s(at - at_), 0.0, 0.1);
  std::copy(pose_.locals().begin(), pose_.locals().end(), locals_.begin());
  locals_[0].position += ahead_s * velocity_m_s_;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    locals_[b].rotation = (body::turn_by(ahead_s * bones_[b].spin_rad_s) * locals_[b].rotation).normalized();
  }
  ahead_.set_locals(locals_);
  for (std::size_t m = 0; m < markers_.size(); ++m) {
    const Label label{id, static_cast<std::uint32_t>(m)};
    const double sigma = told_sigma(m, at);
    const ExpectedMarker expected{{told(m, ahead_)}, sigma * sigma * Eigen::Matrix3d::Identity(), {}, label};
    if (!into.markers.try_push_back(expected)) return;
  }
}

class TreeSolver final : public SkeletonSolver {
 public:
  TreeSolver(const SolveSettings& settings, const std::vector<Subject>& subjects) {
    MOCAP_EXPECTS(subjects.size() <= kMaxSubjects);
    subjects_.reserve(subjects.size());
    for (const Subject& subject : subjects) subjects_.emplace_back(settings, subject);
  }

  const Poses& solve(Labels& labels, Timestamp at) override {
    poses_.resize(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
      poses_[i].subject = labels[i].subject;
      poses_[i].bones.clear();
      if (labels[i].subject.value < subjects_.size())
        subjects_[labels[i].subject.value].solve(labels[i], at, poses_[i]);
    }
    return poses_;
  }

  void refit(const SubjectFit& fit) override {
    if (fit.subject.value < subjects_.size()) subjects_[fit.subject.value].refit(fit);
  }

  void predict(Timestamp at, Expected& into) const override {
    for (std::size_t i = 0; i < subjects_.size(); ++i) {
      subjects_[i].predict(SubjectId{static_cast<std::uint32_t>(i)}, at, into);
    }
  }

 private:
  mutable std::vector<OneSubject> subjects_;  // predict uses their scratch
  Poses poses_;
};

}  // namespace

std::unique_ptr<SkeletonSolver> make_skeleton_solver(const SolveSettings& settings, std::vector<Subject> subjects) {
  return std::make_unique<TreeSolver>(settings, subjects);
}

}  // namespace mocap::stages
