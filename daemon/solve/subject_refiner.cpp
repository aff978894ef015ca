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
constexpr std::size_t kLeastInstants = 8;
constexpr std::size_t kHeldOut = 10;
constexpr std::size_t kLeastHeldOut = 2;
constexpr std::size_t kHoldOutEvery = 4;  // of the poses that are new
// A fit is tried again when as many more poses as this share of all before are new.
constexpr double kMore = 1.4;
constexpr double kLeastShare = 0.6;  // of the markers that an instant must show
// A pose differs when one joint has turned by 15 degrees, or ten by 5: sum of sin^2 of the half angles.
constexpr double kNew = 0.018;
// Noise of a place that counts in full; what cameras tell worse counts less.
constexpr double kGoodPlace_m = 0.0005;
constexpr double kCosOfHalfNearRest = 0.92;  // of a joint within 46 degrees of the rest pose, however markers are stuck
constexpr double kMostAtRest = 0.8;          // share of the joints
constexpr double kCosOfMostOffRest = 0.94;   // of a bone's direction, 20 degrees from where it lies at rest
constexpr double kShort_m = 0.2;             // what lies nearer to a joint tells no direction: markers are 2 cm off
constexpr double kLeastGain_m = 1e-4;        // by which poses must be nearer, rms
constexpr double kMostResidual_m = 0.04;     // of a pose that is worth looking at

double apart(const std::vector<Pose>& a, const std::vector<Pose>& b) {
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
      : kept_(capacity, bodyfit::empty_instant(set)), apart_(capacity * capacity) {}

  std::size_t size() const { return size_; }
  std::span<const BodyInstant> kept() const { return std::span(kept_).first(size_); }
  void clear() { size_ = 0; }

  double nearest(const BodyInstant& to) const {
    double least = std::numeric_limits<double>::infinity();
    for (const BodyInstant& one : kept()) least = std::min(least, apart(one.locals, to.locals));
    return least;
  }

  /// Takes it where there is room, or in place of one of the two that are most alike, if it differs more.
  bool offer(const BodyInstant& instant) {
    const double differs = nearest(instant);
    if (size_ < kept_.size()) {
      put(size_++, instant);
      return true;
    }
    std::size_t alike = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < size_; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (apart_[i * kept_.size() + j] < least) {
          least = apart_[i * kept_.size() + j];
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
    copy(instant, kept_[at]);
    for (std::size_t i = 0; i < size_; ++i) {
      const double far = i == at ? 0.0 : apart(kept_[i].locals, instant.locals);
      apart_[i * kept_.size() + at] = apart_[at * kept_.size() + i] = far;
    }
  }

  std::vector<BodyInstant> kept_;
  std::vector<double> apart_;
  std::size_t size_ = 0;
};

}  // namespace

class SubjectRefiner::OneSubject {
 public:
  OneSubject(const RefineSettings& settings, const Subject& subject, SubjectId id)
      : settings_(settings),
        id_(id),
        set_(subject.marker_set),
        worn_(bodyfit::offsets_of(set_)),
        fitter_(set_,
                subject.fitted || set_.skeleton.bones.size() == 1 ? bodyfit::priors_of_fitted() : bodyfit::OffsetPriors{},
                settings.instants),
        poses_(set_, settings.instants),
        held_out_(set_, kHeldOut),
        instants_(settings.instants, bodyfit::empty_instant(set_)),
        seen_(bodyfit::empty_instant(set_)),
        judged_(bodyfit::empty_instant(set_)),
        root_from_(set_.skeleton.bones.size()),
        known_(subject.fitted || set_.skeleton.bones.size() == 1) {}

  void recognised(const SubjectFit& fit) {
    std::copy(fit.rest_offsets_m.begin(), fit.rest_offsets_m.end(), worn_.bones_m.begin());
    std::copy(fit.marker_offsets_m.begin(), fit.marker_offsets_m.end(), worn_.markers_m.begin());
    poses_.clear();
    held_out_.clear();
    stage_ = Stage::Gather;
    rest_is_new_ = false;
    offered_ = 0;
    fit_at_ = kLeastInstants;
    wait_for_rest_ = known_ = true;
  }

  void look(const SubjectLabels& labels, const SubjectPose& pose, Timestamp at) {
    if (!known_ || labels.phase != SubjectPhase::Tracking || pose.bones.size() != set_.skeleton.bones.size()) return;
    if (!wait_for_rest_ && looked_ && at - *looked_ < settings_.look_every && at >= *looked_) return;
    looked_ = at;
    if (!take(labels, pose)) return;
    if (wait_for_rest_) {
      wait_for_rest_ = false;
      if (!stands_at_rest()) return;
      // It was recognised by a pose that is known: what joints that are at rest in it seem to be turned by is where
      // their markers are stuck.
      mark_rest();
      rest_is_new_ = true;
      (void)poses_.offer(seen_);
      return;
    }
    if (poses_.nearest(seen_) < kNew || held_out_.nearest(seen_) < kNew) return;
    ++offered_;
    (void)(offered_ % kHoldOutEvery == 0 ? held_out_ : poses_).offer(seen_);
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
        if (rest_is_new_) {
          rest_is_new_ = false;
          stage_ = Stage::Gather;
          return wear();
        }
        stage_ = Stage::Judge;
        next_ = 0;
        worn_m2_ = fitted_m2_ = judged_markers_ = 0.0;
        break;
      case Stage::Judge:
        judge_next();
        if (next_ < 2 * held_out_.size()) break;
        stage_ = Stage::Gather;
        if (is_better()) return wear();
        break;
    }
    return std::nullopt;
  }

 private:
  enum class Stage { Gather, Fit, Judge };

  bool ready() const {
    if (rest_is_new_) return true;
    return poses_.size() >= kLeastInstants && held_out_.size() >= kLeastHeldOut && offered_ >= fit_at_;
  }

  // This set's markers and pose as an instant; false when they are not worth it.
  bool take(const SubjectLabels& labels, const SubjectPose& pose) {
    if (!(pose.residual_m < kMostResidual_m)) return false;
    std::size_t count = 0;
    for (std::size_t m = 0; m < seen_.seen_m.size(); ++m) {
      const LabelledMarker& label = labels.markers[m];
      const bool there = label.state == LabelState::Measured && label.position.v.allFinite();
      const double noise_m2 = label.covariance_m2.trace() / 3.0;
      seen_.trust[m] =
          !there || !(noise_m2 >= 0.0) ? 0.0 : 1.0 / std::max(1.0, noise_m2 / (kGoodPlace_m * kGoodPlace_m));
      if (there) seen_.seen_m[m] = label.position.v;
      count += there ? 1 : 0;
    }
    for (std::size_t b = 0; b < seen_.locals.size(); ++b) seen_.locals[b] = pose.bones[b].parent_from_bone;
    std::fill(seen_.at_rest.begin(), seen_.at_rest.end(), std::uint8_t{0});
    return static_cast<double>(count) >= kLeastShare * static_cast<double>(seen_.seen_m.size());
  }

  // Whether most joints are about where the rest pose has them: somebody may have been recognised in another.
  bool stands_at_rest() const {
    std::size_t near = 0;
    for (std::size_t b = 1; b < seen_.locals.size(); ++b) {
      near += std::abs(seen_.locals[b].rotation.w()) > kCosOfHalfNearRest ? 1 : 0;
    }
    return static_cast<double>(near) >= kMostAtRest * static_cast<double>(seen_.locals.size() - 1);
  }

  // Which joints are held as in the rest pose: down from the trunk all bones that lie as they do there. In A-pose the
  // arms do not. How a bone is turned about itself says nothing: that is what its markers' places tell wrongly.
  void mark_rest() {
    const auto& bones = set_.skeleton.bones;
    std::fill(seen_.at_rest.begin(), seen_.at_rest.end(), std::uint8_t{1});
    for (std::size_t b = 1; b < bones.size(); ++b) {
      const auto above = static_cast<std::size_t>(bones[b].parent);
      root_from_[b] = above == 0 ? seen_.locals[b].rotation : root_from_[above] * seen_.locals[b].rotation;
      const Eigen::Vector3d& way_m = worn_.bones_m[b];
      if (above == 0 || way_m.norm() < kShort_m) continue;
      if (way_m.dot(root_from_[above] * way_m) < kCosOfMostOffRest * way_m.squaredNorm()) seen_.at_rest[above] = 0;
    }
    for (std::size_t b = 1; b < bones.size(); ++b) {
      if (seen_.at_rest[static_cast<std::size_t>(bones[b].parent)] == 0) seen_.at_rest[b] = 0;
    }
  }

  void begin() {
    const auto kept = poses_.kept();
    for (std::size_t i = 0; i < kept.size(); ++i) copy(kept[i], instants_[i]);
    fitter_.begin(worn_, worn_size_, std::span(instants_).first(kept.size()));
    if (!rest_is_new_) fit_at_ = static_cast<std::size_t>(std::ceil(kMore * static_cast<double>(offered_)));
    stage_ = Stage::Fit;
  }

  // Each held-out instant by what is worn and by what was fitted, each in its own best pose.
  void judge_next() {
    if (next_ >= 2 * held_out_.size()) return;
    const bool by_fit = next_ % 2 == 1;
    copy(held_out_.kept()[next_ / 2], judged_);
    const auto judged =
        fitter_.equations().settle(judged_, by_fit ? fitter_.offsets() : worn_, fitter_.cost(), kJudgeSteps);
    (by_fit ? fitted_m2_ : worn_m2_) += judged.data_m2;
    if (!by_fit) judged_markers_ += judged.weight;
    ++next_;
  }

  // Nearer by a share, and by more than cameras and rounding tell: less says nothing about a body.
  bool is_better() const {
    const double share = 1.0 - settings_.least_gain;
    const double count = std::max(1.0, judged_markers_);
    return fitted_m2_ < share * share * worn_m2_ &&
           std::sqrt(worn_m2_ / count) - std::sqrt(fitted_m2_ / count) > kLeastGain_m;
  }

  SubjectFit wear() {
    worn_ = fitter_.offsets();
    worn_size_ = fitter_.size();
    SubjectFit fit;
    fit.subject = id_;
    for (const Eigen::Vector3d& offset : worn_.bones_m) fit.rest_offsets_m.push_back(offset);
    for (const Eigen::Vector3d& offset : worn_.markers_m) fit.marker_offsets_m.push_back(offset);
    fit.residual_m = fitter_.rms_m();
    return fit;
  }

  static constexpr int kJudgeSteps = 4;

  RefineSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  BodyOffsets worn_;
  double worn_size_ = 1.0;
  bodyfit::SubjectFitter fitter_;
  PoseCollection poses_;
  PoseCollection held_out_;
  std::vector<BodyInstant> instants_;  // that the fitter works on
  BodyInstant seen_;
  BodyInstant judged_;
  std::vector<Eigen::Quaterniond> root_from_;  // scratch: by bone, how it lies in the root's frame
  bool known_;                                 // has offsets that are worth refining
  bool wait_for_rest_ = false;
  bool rest_is_new_ = false;
  std::optional<Timestamp> looked_;
  std::size_t offered_ = 0;
  std::size_t fit_at_ = kLeastInstants;
  Stage stage_ = Stage::Gather;
  std::size_t next_ = 0;  // judgement
  double worn_m2_ = 0.0;
  double fitted_m2_ = 0.0;
  double judged_markers_ = 0.0;
};

SubjectRefiner::SubjectRefiner(const RefineSettings& settings, const std::vector<Subject>& subjects)
    : settings_(settings) {
  if (settings_.instants == 0) return;
  settings_.instants = std::max(settings_.instants, kLeastInstants);
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
    if (subject < subjects_.size()) subjects_[subject].look(labels[i], poses[i], at);
  }
  // One subject at a time, to its end: the work of a set does not grow with their number.
  for (std::size_t i = 0; i < subjects_.size() && !subjects_[turn_].has_work(); ++i)
    turn_ = (turn_ + 1) % subjects_.size();
  if (subjects_.empty()) return std::nullopt;
  OneSubject& one = subjects_[turn_];
  for (std::size_t piece = 0; piece < settings_.pieces && one.has_work(); ++piece) {
    if (std::optional<SubjectFit> fit = one.work()) return fit;
  }
  return std::nullopt;
}

}  // namespace mocap::solve
