#include "solve/subject_refiner.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/expects.h"

namespace mocap::solve {
namespace {

using bodyfit::BodyInstant;
using bodyfit::BodyOffsets;

// Fewer poses tell less than the rest pose and the file.
constexpr std::size_t kMinInstants = 8;
constexpr std::size_t kMaxValidation = 10;
constexpr std::size_t kMinValidation = 2;
constexpr std::size_t kValidationInterval = 4;  // of the poses that are new
// A fit is tried again when as many more poses as this share of all before are new.
constexpr double kRefitGrowth = 1.4;
constexpr double kMinMarkerShare = 0.6;  // of the markers that an instant must show
// A pose differs when one joint has turned by 15 degrees, or ten by 5: sum of sin^2 of the half angles.
constexpr double kNewPoseDistance = 0.018;
// Noise of a place that counts in full; what cameras tell worse counts less.
constexpr double kFullTrustSigma_m = 0.0005;
constexpr double kCosHalfRestAngle = 0.92;  // of a joint within 46 degrees of the rest pose, however markers are stuck
constexpr double kMinShareAtRest = 0.8;     // share of the joints
constexpr double kCosMaxBoneDeviation = 0.94;  // of a bone's direction, 20 degrees from where it lies at rest
constexpr double kMinDirectionLength_m = 0.2;  // what lies nearer to a joint tells no direction: markers are 2 cm off
constexpr double kMinGain_m = 1e-4;            // by which poses must be nearer, rms
constexpr double kMaxResidual_m = 0.04;        // of a pose that is worth looking at

double pose_distance(const std::vector<Pose>& a, const std::vector<Pose>& b) {
  double sum = 0.0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    const double cosine = a[i].rotation.dot(b[i].rotation);
    sum += 1.0 - cosine * cosine;
  }
  // A thing of one bone has no joints; its markers are better known from every side.
  if (a.size() == 1) sum = 1.0 - std::pow(a[0].rotation.dot(b[0].rotation), 2);
  return sum;
}

void copy(const BodyInstant& from, BodyInstant& to) {
  std::copy(from.seen_m.begin(), from.seen_m.end(), to.seen_m.begin());
  std::copy(from.trust.begin(), from.trust.end(), to.trust.begin());
  std::copy(from.locals.begin(), from.locals.end(), to.locals.begin());
  std::copy(from.at_rest.begin(), from.at_rest.end(), to.at_rest.begin());
}

// The most different poses that were offered, at most so many; the first may be kept for good.
class PoseCollection {
 public:
  PoseCollection(const MarkerSet& set, std::size_t capacity)
      : collected_(capacity, bodyfit::empty_instant(set)), distances_(capacity * capacity) {}

  std::size_t size() const { return size_; }
  std::span<const BodyInstant> collected() const { return std::span(collected_).first(size_); }
  void clear() { size_ = 0; }

  double nearest(const BodyInstant& to) const {
    double least = std::numeric_limits<double>::infinity();
    for (const BodyInstant& one : collected()) least = std::min(least, pose_distance(one.locals, to.locals));
    return least;
  }

  /// Takes it where there is room, or in place of one of the two that are most alike, if it differs more.
  bool add_if_different(const BodyInstant& instant) {
    const double differs = nearest(instant);
    if (size_ < collected_.size()) {
      put(size_++, instant);
      return true;
    }
    std::size_t alike = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < size_; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (distances_[i * collected_.size() + j] < least) {
          least = distances_[i * collected_.size() + j];
          alike = i;  // the later one: the first of all stays
        }
      }
    }
    if (!(differs > least)) return false;
    put(alike, instant);
    return true;
  }

 private:
  void put(std::size_t at, const BodyInstant& instant) {
    copy(instant, collected_[at]);
    for (std::size_t i = 0; i < size_; ++i) {
      const double far = i == at ? 0.0 : pose_distance(collected_[i].locals, instant.locals);
      distances_[i * collected_.size() + at] = distances_[at * collected_.size() + i] = far;
    }
  }

  std::vector<BodyInstant> collected_;
  std::vector<double> distances_;
  std::size_t size_ = 0;
};

}  // namespace

class SubjectRefiner::SubjectRefinement {
 public:
  SubjectRefinement(const RefineSettings& settings, const Subject& subject, SubjectId id)
      : settings_(settings),
        id_(id),
        set_(subject.marker_set),
        current_offsets_(bodyfit::offsets_of(set_)),
        fitter_(
            set_,
            subject.fitted || set_.skeleton.bones.size() == 1 ? bodyfit::priors_of_fitted() : bodyfit::OffsetPriors{},
            settings.instants),
        poses_(set_, settings.instants),
        validation_poses_(set_, kMaxValidation),
        instants_(settings.instants, bodyfit::empty_instant(set_)),
        instant_(bodyfit::empty_instant(set_)),
        evaluated_(bodyfit::empty_instant(set_)),
        root_from_(set_.skeleton.bones.size()),
        has_offsets_(subject.fitted || set_.skeleton.bones.size() == 1) {}

  void recognised(const SubjectFit& fit) {
    std::copy(fit.rest_offsets_m.begin(), fit.rest_offsets_m.end(), current_offsets_.bones_m.begin());
    std::copy(fit.marker_offsets_m.begin(), fit.marker_offsets_m.end(), current_offsets_.markers_m.begin());
    poses_.clear();
    validation_poses_.clear();
    stage_ = Stage::Gather;
    has_new_rest_pose_ = false;
    new_pose_count_ = 0;
    next_fit_count_ = kMinInstants;
    waiting_for_rest_ = has_offsets_ = true;
  }

  void observe(const SubjectLabels& labels, const SubjectPose& pose, Timestamp at) {
    if (!has_offsets_ || labels.phase != SubjectPhase::Tracking || pose.bones.size() != set_.skeleton.bones.size())
      return;
    if (!waiting_for_rest_ && observed_at_ && at - *observed_at_ < settings_.look_every && at >= *observed_at_) return;
    observed_at_ = at;
    if (!capture(labels, pose)) return;
    if (waiting_for_rest_) {
      waiting_for_rest_ = false;
      if (!is_near_rest_pose()) return;
      // It was recognised by a pose that is known: what joints that are at rest in it seem to be turned by is where
      // their markers are stuck.
      mark_joints_at_rest();
      has_new_rest_pose_ = true;
      (void)poses_.add_if_different(instant_);
      return;
    }
    if (poses_.nearest(instant_) < kNewPoseDistance || validation_poses_.nearest(instant_) < kNewPoseDistance) return;
    ++new_pose_count_;
    (void)(new_pose_count_ % kValidationInterval == 0 ? validation_poses_ : poses_).add_if_different(instant_);
  }

  bool has_work() const { return stage_ != Stage::Gather || ready(); }

  std::optional<SubjectFit> work() {
    switch (stage_) {
      case Stage::Gather:
        if (ready()) begin();
        break;
      case Stage::Fit:
        if (!fitter_.work()) break;
        // What the rest pose alone and the file say of the body, nothing but themselves can judge.
        if (has_new_rest_pose_) {
          has_new_rest_pose_ = false;
          stage_ = Stage::Gather;
          return apply_offsets();
        }
        stage_ = Stage::Judge;
        next_ = 0;
        current_residual_m2_ = fitted_residual_m2_ = evaluated_markers_ = 0.0;
        break;
      case Stage::Judge:
        evaluate_next();
        if (next_ < 2 * validation_poses_.size()) break;
        stage_ = Stage::Gather;
        if (is_better()) return apply_offsets();
        break;
    }
    return std::nullopt;
  }

 private:
  enum class Stage { Gather, Fit, Judge };

  bool ready() const {
    if (has_new_rest_pose_) return true;
    return poses_.size() >= kMinInstants && validation_poses_.size() >= kMinValidation &&
           new_pose_count_ >= next_fit_count_;
  }

  // This set's markers and pose as an instant; false when they are not worth it.
  bool capture(const SubjectLabels& labels, const SubjectPose& pose) {
    if (!(pose.residual_m < kMaxResidual_m)) return false;
    std::size_t count = 0;
    for (std::size_t m = 0; m < instant_.seen_m.size(); ++m) {
      const LabelledMarker& label = labels.markers[m];
      const bool there = label.state == LabelState::Measured && label.position.v.allFinite();
      const double noise_m2 = label.covariance_m2.trace() / 3.0;
      instant_.trust[m] =
          !there || !(noise_m2 >= 0.0) ? 0.0 : 1.0 / std::max(1.0, noise_m2 / (kFullTrustSigma_m * kFullTrustSigma_m));
      if (there) instant_.seen_m[m] = label.position.v;
      count += there ? 1 : 0;
    }
    for (std::size_t b = 0; b < instant_.locals.size(); ++b) instant_.locals[b] = pose.bones[b].parent_from_bone;
    std::fill(instant_.at_rest.begin(), instant_.at_rest.end(), std::uint8_t{0});
    return static_cast<double>(count) >= kMinMarkerShare * static_cast<double>(instant_.seen_m.size());
  }

  // Whether most joints are about where the rest pose has them: somebody may have been recognised in another.
  bool is_near_rest_pose() const {
    std::size_t near = 0;
    for (std::size_t b = 1; b < instant_.locals.size(); ++b) {
      near += std::abs(instant_.locals[b].rotation.w()) > kCosHalfRestAngle ? 1 : 0;
    }
    return static_cast<double>(near) >= kMinShareAtRest * static_cast<double>(instant_.locals.size() - 1);
  }

  // Which joints are held as in the rest pose: down from the trunk all bones that lie as they do there. In A-pose the
  // arms do not. How a bone is turned about itself says nothing: that is what its markers' places tell wrongly.
  void mark_joints_at_rest() {
    const auto& bones = set_.skeleton.bones;
    std::fill(instant_.at_rest.begin(), instant_.at_rest.end(), std::uint8_t{1});
    for (std::size_t b = 1; b < bones.size(); ++b) {
      const auto above = static_cast<std::size_t>(bones[b].parent);
      root_from_[b] = above == 0 ? instant_.locals[b].rotation : root_from_[above] * instant_.locals[b].rotation;
      const Eigen::Vector3d& way_m = current_offsets_.bones_m[b];
      if (above == 0 || way_m.norm() < kMinDirectionLength_m) continue;
      if (way_m.dot(root_from_[above] * way_m) < kCosMaxBoneDeviation * way_m.squaredNorm())
        instant_.at_rest[above] = 0;
    }
    for (std::size_t b = 1; b < bones.size(); ++b) {
      if (instant_.at_rest[static_cast<std::size_t>(bones[b].parent)] == 0) instant_.at_rest[b] = 0;
    }
  }

  void begin() {
    const auto collected = poses_.collected();
    for (std::size_t i = 0; i < collected.size(); ++i) copy(collected[i], instants_[i]);
    fitter_.begin(current_offsets_, current_scale_, std::span(instants_).first(collected.size()));
    if (!has_new_rest_pose_)
      next_fit_count_ = static_cast<std::size_t>(std::ceil(kRefitGrowth * static_cast<double>(new_pose_count_)));
    stage_ = Stage::Fit;
  }

  // Each held-out instant by what is worn and by what was fitted, each in its own best pose.
  void evaluate_next() {
    if (next_ >= 2 * validation_poses_.size()) return;
    const bool by_fit = next_ % 2 == 1;
    copy(validation_poses_.collected()[next_ / 2], evaluated_);
    const auto judged = fitter_.equations().optimise_pose(evaluated_, by_fit ? fitter_.offsets() : current_offsets_,
                                                          fitter_.cost(), kEvaluationSteps);
    (by_fit ? fitted_residual_m2_ : current_residual_m2_) += judged.data_m2;
    if (!by_fit) evaluated_markers_ += judged.weight;
    ++next_;
  }

  // Nearer by a share, and by more than cameras and rounding tell: less says nothing about a body.
  bool is_better() const {
    const double share = 1.0 - settings_.least_gain;
    const double count = std::max(1.0, evaluated_markers_);
    return fitted_residual_m2_ < share * share * current_residual_m2_ &&
           std::sqrt(current_residual_m2_ / count) - std::sqrt(fitted_residual_m2_ / count) > kMinGain_m;
  }

  SubjectFit apply_offsets() {
    current_offsets_ = fitter_.offsets();
    current_scale_ = fitter_.size();
    SubjectFit fit;
    fit.subject = id_;
    for (const Eigen::Vector3d& offset : current_offsets_.bones_m) fit.rest_offsets_m.push_back(offset);
    for (const Eigen::Vector3d& offset : current_offsets_.markers_m) fit.marker_offsets_m.push_back(offset);
    fit.residual_m = fitter_.rms_m();
    return fit;
  }

  static constexpr int kEvaluationSteps = 4;

  RefineSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  BodyOffsets current_offsets_;
  double current_scale_ = 1.0;
  bodyfit::SubjectFitter fitter_;
  PoseCollection poses_;
  PoseCollection validation_poses_;
  std::vector<BodyInstant> instants_;  // that the fitter works on
  BodyInstant instant_;
  BodyInstant evaluated_;
  std::vector<Eigen::Quaterniond> root_from_;  // scratch: by bone, how it lies in the root's frame
  bool has_offsets_;                           // has offsets that are worth refining
  bool waiting_for_rest_ = false;
  bool has_new_rest_pose_ = false;
  std::optional<Timestamp> observed_at_;
  std::size_t new_pose_count_ = 0;
  std::size_t next_fit_count_ = kMinInstants;
  Stage stage_ = Stage::Gather;
  std::size_t next_ = 0;  // judgement
  double current_residual_m2_ = 0.0;
  double fitted_residual_m2_ = 0.0;
  double evaluated_markers_ = 0.0;
};

SubjectRefiner::SubjectRefiner(const RefineSettings& settings, const std::vector<Subject>& subjects)
    : settings_(settings) {
  if (settings_.instants == 0) return;
  settings_.instants = std::max(settings_.instants, kMinInstants);
  subjects_.reserve(subjects.size());
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    subjects_.emplace_back(settings_, subjects[i], SubjectId{static_cast<std::uint32_t>(i)});
  }
}

SubjectRefiner::~SubjectRefiner() = default;
SubjectRefiner::SubjectRefiner(SubjectRefiner&&) noexcept = default;

void SubjectRefiner::recognised(const SubjectFit& fit) {
  if (fit.subject.value < subjects_.size()) subjects_[fit.subject.value].recognised(fit);
}

std::optional<SubjectFit> SubjectRefiner::step(const Labels& labels, const Poses& poses, Timestamp at) {
  for (std::size_t i = 0; i < labels.size() && i < poses.size(); ++i) {
    const std::size_t subject = labels[i].subject.value;
    if (subject < subjects_.size()) subjects_[subject].observe(labels[i], poses[i], at);
  }
  // One subject at a time, to its end: the work of a set does not grow with their number.
  for (std::size_t i = 0; i < subjects_.size() && !subjects_[next_subject_].has_work(); ++i)
    next_subject_ = (next_subject_ + 1) % subjects_.size();
  if (subjects_.empty()) return std::nullopt;
  SubjectRefinement& one = subjects_[next_subject_];
  for (std::size_t piece = 0; piece < settings_.pieces && one.has_work(); ++piece) {
    if (std::optional<SubjectFit> fit = one.work()) return fit;
  }
  return std::nullopt;
}

}  // namespace mocap::solve
