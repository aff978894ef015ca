#include "stages/solve_skeleton.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "body/follow_body.h"
#include "body/rotation.h"

namespace mocap::stages {
namespace {

using body::BodyFollower;
using body::Observation;

// A marker that the body tells is never surer than this, nor less sure than an arm's swing.
constexpr double kLeastSigma_m = 0.005;
constexpr double kMostSigma_m = 0.15;

struct BoneMemory {
  Timestamp seen_at;
  Eigen::Quaterniond shown_world = Eigen::Quaterniond::Identity();
  Eigen::Quaterniond shown_local = Eigen::Quaterniond::Identity();
};

class OneSubject {
 public:
  OneSubject(const SolveSettings& settings, const Subject& subject);

  void solve(SubjectLabels& labels, Timestamp at, SubjectPose& into);
  void refit(const SubjectFit& fit) { body_.refit(fit.rest_offsets_m, fit.marker_offsets_m); }
  void predict(SubjectId id, Timestamp at, Expected& into);

 private:
  void gather(const SubjectLabels& labels, Timestamp at);
  void show(Timestamp at, SubjectPose& into);
  bool bone_seen(std::size_t bone) const;
  void judge_places(Timestamp at);
  void fill(SubjectLabels& labels, Timestamp at);

  SolveSettings settings_;
  BodyFollower body_;
  std::vector<BoneMemory> bones_;
  std::vector<Eigen::Matrix3d> covariances_m2_;  // of the place that the body tells, by marker
  std::vector<bool> seen_marker_;
  std::vector<int> own_markers_;   // by bone
  std::vector<int> seen_markers_;  // by bone, in this set
  std::vector<Observation> seen_;
};

OneSubject::OneSubject(const SolveSettings& settings, const Subject& subject)
    : settings_(settings),
      body_(subject.marker_set, {.outlier_m = settings.outlier_m, .max_iterations = settings.max_iterations}) {
  const auto& bones = subject.marker_set.skeleton.bones;
  const std::size_t markers = subject.marker_set.markers.size();
  MOCAP_EXPECTS(bones.size() <= kMaxBones && markers <= kMaxLabels);
  bones_.resize(bones.size());
  covariances_m2_.resize(markers, Eigen::Matrix3d::Identity());
  seen_marker_.resize(markers);
  own_markers_.resize(bones.size());
  for (const MarkerOnBone& marker : subject.marker_set.markers) ++own_markers_[static_cast<std::size_t>(marker.bone)];
  seen_markers_.resize(bones.size());
  seen_.reserve(markers);
}

void OneSubject::gather(const SubjectLabels& labels, Timestamp at) {
  seen_.clear();
  std::fill(seen_markers_.begin(), seen_markers_.end(), 0);
  std::fill(seen_marker_.begin(), seen_marker_.end(), false);
  const MarkerSet& set = body_.pose().marker_set();
  for (std::size_t m = 0; m < labels.markers.size() && m < seen_marker_.size(); ++m) {
    const LabelledMarker& label = labels.markers[m];
    if (label.state != LabelState::Measured || !label.position.v.allFinite()) continue;
    const double noise = std::clamp(label.covariance_m2.trace() / 3.0, 0.0, 1.0);
    const double sigma =
        std::sqrt(settings_.marker_sigma_m * settings_.marker_sigma_m + (std::isfinite(noise) ? noise : 1.0));
    seen_.push_back({static_cast<int>(m), label.position.v, sigma});
    seen_marker_[m] = true;
    const auto bone = static_cast<std::size_t>(set.markers[m].bone);
    ++seen_markers_[bone];
    bones_[bone].seen_at = at;
  }
}

// Half of a bone's own markers tell it; a bone without any is told by its neighbours.
bool OneSubject::bone_seen(std::size_t bone) const {
  if (own_markers_[bone] > 0) return 2 * seen_markers_[bone] >= own_markers_[bone];
  const int parent = body_.pose().marker_set().skeleton.bones[bone].parent;
  return parent >= 0 && seen_markers_[static_cast<std::size_t>(parent)] > 0 &&
         body_.told_by_markers(bone) != BodyFollower::Told::No;
}

void OneSubject::show(Timestamp at, SubjectPose& into) {
  into.residual_m = body_.residual_m();
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& memory = bones_[b];
    const Pose& world = body_.pose().world()[b];
    const Pose& local = body_.pose().locals()[b];
    memory.shown_world = body::same_side(world.rotation, memory.shown_world);
    memory.shown_local = body::same_side(local.rotation, memory.shown_local);
    BonePose& bone = into.bones.push_back({});
    bone.world_from_bone = {world.position, memory.shown_world};
    bone.parent_from_bone = {local.position, memory.shown_local};
    bone.state = bone_seen(b) ? BoneState::Measured : BoneState::Filled;
    if (bone.state == BoneState::Measured) memory.seen_at = at;
    const double unseen_s = to_s(at - memory.seen_at);
    const double share = own_markers_[b] > 0 ? static_cast<double>(seen_markers_[b]) / own_markers_[b] : 1.0;
    const double sure =
        bone.state == BoneState::Measured ? 0.5 + 0.5 * std::min(1.0, share) : 0.5 * std::exp(-unseen_s);
    bone.confidence = static_cast<float>(sure);
  }
}

// How surely the body tells each marker: what was seen, by the fit; the rest by what hangs between.
void OneSubject::judge_places(Timestamp at) {
  const bool told = body_.weigh(seen_, at);
  const Eigen::Matrix3d residual = std::pow(body_.residual_m(), 2) * Eigen::Matrix3d::Identity();
  for (std::size_t m = 0; m < covariances_m2_.size(); ++m) {
    if (seen_marker_[m]) {
      covariances_m2_[m] = kLeastSigma_m * kLeastSigma_m * Eigen::Matrix3d::Identity() + residual;
      continue;
    }
    covariances_m2_[m].setIdentity();
    if (told) covariances_m2_[m] = body_.told_covariance(m) + residual;
    const double most = covariances_m2_[m].trace() / (kMostSigma_m * kMostSigma_m);
    if (!(most < 1.0)) covariances_m2_[m] /= most;
    if (!covariances_m2_[m].allFinite()) covariances_m2_[m] = std::pow(kMostSigma_m, 2) * Eigen::Matrix3d::Identity();
  }
}

void OneSubject::fill(SubjectLabels& labels, Timestamp at) {
  for (std::size_t m = 0; m < labels.markers.size() && m < seen_marker_.size(); ++m) {
    LabelledMarker& label = labels.markers[m];
    if (label.state == LabelState::Measured) continue;
    const double unseen_s = body_.unseen_s(m, at);
    if (unseen_s > settings_.fill_for_s) {
      label.state = LabelState::Lost;
      label.confidence = 0.0F;
      continue;
    }
    label.state = LabelState::Filled;
    label.position.v = body_.told(m);
    label.covariance_m2 = covariances_m2_[m];
    label.residual_px = 0.0;
    label.cameras = 0;
    label.confidence = static_cast<float>(0.8 * std::exp(-unseen_s));
  }
}

void OneSubject::solve(SubjectLabels& labels, Timestamp at, SubjectPose& into) {
  into.bones.clear();
  into.residual_m = 0.0;
  if (labels.phase != SubjectPhase::Tracking) {
    body_.forget();
    return;
  }
  gather(labels, at);
  if (!body_.following() || at < body_.learnt_at()) {
    if (!body_.start(seen_, at)) return;
    for (BoneMemory& bone : bones_) bone.seen_at = at;
  } else {
    body_.predict(at);
    (void)body_.fit(seen_);
    body_.learn(seen_);
  }
  judge_places(at);
  show(at, into);
  fill(labels, at);
}

void OneSubject::predict(SubjectId id, Timestamp at, Expected& into) {
  if (!body_.following()) return;
  body_.predict(at);
  for (std::size_t m = 0; m < covariances_m2_.size(); ++m) {
    const Label label{id, static_cast<std::uint32_t>(m)};
    if (!into.markers.try_push_back({{body_.told(m)}, covariances_m2_[m], {}, label, 0})) return;
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
