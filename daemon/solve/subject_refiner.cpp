#include "solve/subject_refiner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/expects.h"
#include "solve/pose_collection.h"

namespace mocap::solve {
namespace {

using bodyfit::BodyInstant;
using bodyfit::BodyOffsets;

// All values were chosen by hand and are not yet measured. Smallest number of poses of a fit: fewer poses have less
// information about the body than the rest pose and the marker set file.
constexpr std::size_t kMinInstants = 8;
// Poses that are held out of the fit for validation.
constexpr std::size_t kMaxValidation = 10;
constexpr std::size_t kMinValidation = 2;
// Every fourth new pose, until the body was refined once: its errors are far above those of skin. Afterwards the second
// of four blocks of time, with a pause before each: skin has a memory, so that poses beside those of the fit would
// confirm its errors (decision 0006).
constexpr std::size_t kValidationInterval = 4;
constexpr Duration kBlock = std::chrono::seconds(1);
constexpr Duration kPause = std::chrono::milliseconds(300);
constexpr std::int64_t kBlocksPerValidation = 4;
// The next fit starts when the number of new poses has grown by this factor since the last fit.
constexpr double kRefitGrowth = 1.4;
// Fraction of the markers that a stored pose must have.
constexpr double kMinMarkerFraction = 0.6;
// A pose is new if one joint differs by 15 degrees, or ten by 5: sum of the squared sines of the half angles.
constexpr double kNewPoseDistance = 0.018;
// Position noise up to which a marker has full weight; a marker with more noise has less.
constexpr double kFullTrustSigma_m = 0.0005;
// Cosine of half of 46 degrees: joints within this angle of the rest pose, with markers attached anywhere, are at rest.
constexpr double kCosHalfRestAngle = 0.92;
// Fraction of the joints at rest in a rest pose.
constexpr double kMinFractionAtRest = 0.8;
// Cosine of 20 degrees: largest deviation of a bone's direction from the rest pose, for bones of at least this length.
// With markers 2 cm off, shorter bones have no reliable direction.
constexpr double kCosMaxBoneDeviation = 0.94;
constexpr double kMinDirectionLength_m = 0.2;
// Smallest improvement of the rms residual of the validation poses.
constexpr double kMinGain_m = 1e-4;
// Largest residual of a pose that is stored.
constexpr double kMaxResidual_m = 0.04;

}  // namespace

// The refinement of one subject: gathers poses, fits, validates.
class SubjectRefiner::SubjectRefinement {
 public:
  SubjectRefinement(const RefineSettings& settings, const Subject& subject, SubjectId id)
      : settings_(settings),
        id_(id),
        set_(subject.marker_set),
        current_offsets_(bodyfit::offsets_of(set_)),
        has_known_bones_(subject.fitted || rigid()),
        fitter_(set_, priors(), settings.instants),
        poses_(set_, settings.instants),
        validation_poses_(set_, kMaxValidation),
        instants_(settings.instants, bodyfit::empty_instant(set_)),
        instant_(bodyfit::empty_instant(set_)),
        evaluated_(bodyfit::empty_instant(set_)),
        root_from_(set_.skeleton.bones.size()),
        is_refined_(subject.fitted),
        has_offsets_(subject.fitted || rigid()) {}

  void recognised(const SubjectFit& fit) {
    std::copy(fit.rest_offsets_m.begin(), fit.rest_offsets_m.end(), current_offsets_.bones_m.begin());
    std::copy(fit.marker_offsets_m.begin(), fit.marker_offsets_m.end(), current_offsets_.markers_m.begin());
    discard_poses();
    if (fit.at_identification && !rigid()) set_known_bones(false);
    waiting_for_rest_ = !fit.in_any_pose;
    has_offsets_ = true;
  }

  void forget() {
    discard_poses();
    waiting_for_rest_ = false;
    has_offsets_ = rigid();
  }

  void adopt(SubjectRefinement& before) {
    if (!(before.settings_ == settings_)) {
      current_offsets_ = before.current_offsets_;
      has_offsets_ = before.has_offsets_;
      is_refined_ = before.is_refined_;
      set_known_bones(has_known_bones_ && before.has_known_bones_);
      return;
    }
    const SubjectId id = id_;
    *this = std::move(before);
    id_ = id;
  }

  void archive(Archive& members) {
    members(has_known_bones_);
    if (members.is_reading()) set_known_bones(has_known_bones_);
    members(current_offsets_, current_scale_, poses_, validation_poses_, instant_, is_refined_, has_offsets_,
            waiting_for_rest_, has_new_rest_pose_, observed_at_, began_at_, new_pose_count_, next_fit_count_, stage_,
            next_, current_residual_m2_, fitted_residual_m2_, evaluated_markers_, fitter_);
    if (stage_ < Stage::Gather || stage_ > Stage::Validate) members.fail();
    if (stage_ == Stage::Fit) fitter_.archive_fit(members, instants_);
  }

  void observe(const SubjectLabels& labels, const SubjectPose& pose, Timestamp at) {
    if (!has_offsets_ || labels.phase != SubjectPhase::Tracking || pose.bones.size() != set_.skeleton.bones.size())
      return;
    if (!waiting_for_rest_ && observed_at_ && at - *observed_at_ < settings_.look_every && at >= *observed_at_) return;
    observed_at_ = at;
    if (!began_at_ || at < *began_at_) began_at_ = at;
    if (!capture(labels, pose)) return;
    if (waiting_for_rest_) {
      waiting_for_rest_ = false;
      if (!is_near_rest_pose()) return;
      // The subject was identified in a known pose. An apparent rotation of a joint that is at rest is therefore an
      // error of the marker offsets.
      mark_joints_at_rest();
      has_new_rest_pose_ = true;
      (void)poses_.add_if_different(instant_);
      return;
    }
    const Duration since = at - *began_at_;
    if (is_refined_ && since % kBlock < kPause) return;
    const bool is_held_out =
        is_refined_ ? since / kBlock % kBlocksPerValidation == 1 : (new_pose_count_ + 1) % kValidationInterval == 0;
    PoseCollection& to = is_held_out ? validation_poses_ : poses_;
    if (to.nearest(instant_) < kNewPoseDistance) return;
    if (!is_refined_ && (is_held_out ? poses_ : validation_poses_).nearest(instant_) < kNewPoseDistance) return;
    ++new_pose_count_;
    (void)to.add_if_different(instant_);
  }

  bool has_work() const { return stage_ != Stage::Gather || ready(); }

  std::optional<SubjectFit> work() {
    switch (stage_) {
      case Stage::Gather:
        if (ready()) begin();
        break;
      case Stage::Fit:
        if (!fitter_.work()) break;
        // A fit to the rest pose alone has no validation poses.
        if (has_new_rest_pose_) {
          has_new_rest_pose_ = false;
          stage_ = Stage::Gather;
          return apply_offsets();
        }
        stage_ = Stage::Validate;
        next_ = 0;
        current_residual_m2_ = fitted_residual_m2_ = evaluated_markers_ = 0.0;
        break;
      case Stage::Validate:
        evaluate_next();
        if (next_ < 2 * validation_poses_.size()) break;
        stage_ = Stage::Gather;
        if (!is_better()) break;
        if (!is_refined_) {
          is_refined_ = true;
          validation_poses_.clear();
          began_at_.reset();
        }
        return apply_offsets();
        break;
    }
    return std::nullopt;
  }

 private:
  enum class Stage { Gather, Fit, Validate };

  bool rigid() const { return set_.skeleton.bones.size() == 1; }
  bodyfit::OffsetPriors priors() const {
    return has_known_bones_ ? bodyfit::priors_of_fitted() : bodyfit::OffsetPriors{};
  }
  void set_known_bones(bool known) {
    has_known_bones_ = known;
    fitter_.set_priors(priors());
  }

  // Ends a fit in work, too.
  void discard_poses() {
    poses_.clear();
    validation_poses_.clear();
    began_at_.reset();
    is_refined_ = false;
    stage_ = Stage::Gather;
    has_new_rest_pose_ = false;
    new_pose_count_ = 0;
    next_fit_count_ = kMinInstants;
  }

  bool ready() const {
    if (has_new_rest_pose_) return true;
    return poses_.size() >= kMinInstants && validation_poses_.size() >= kMinValidation &&
           new_pose_count_ >= next_fit_count_;
  }

  // Copies markers and pose of this set to instant_. Returns false if the residual is too large or markers are missing.
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
    return static_cast<double>(count) >= kMinMarkerFraction * static_cast<double>(instant_.seen_m.size());
  }

  // Whether most joints are near the rest pose; the subject may have been identified in another pose.
  bool is_near_rest_pose() const {
    std::size_t near = 0;
    for (std::size_t b = 1; b < instant_.locals.size(); ++b) {
      near += std::abs(instant_.locals[b].rotation.w()) > kCosHalfRestAngle ? 1 : 0;
    }
    return static_cast<double>(near) >= kMinFractionAtRest * static_cast<double>(instant_.locals.size() - 1);
  }

  // Marks the joints that are at rest: from the trunk outwards, all joints whose bones have the directions of the rest
  // pose. In A-pose the arms do not. The twist of a bone is not compared, because wrong marker offsets change it.
  void mark_joints_at_rest() {
    const auto& bones = set_.skeleton.bones;
    std::fill(instant_.at_rest.begin(), instant_.at_rest.end(), std::uint8_t{1});
    for (std::size_t b = 1; b < bones.size(); ++b) {
      const auto above = static_cast<std::size_t>(bones[b].parent);
      root_from_[b] = above == 0 ? instant_.locals[b].rotation : root_from_[above] * instant_.locals[b].rotation;
      const Eigen::Vector3d& bone_vector_m = current_offsets_.bones_m[b];
      if (above == 0 || bone_vector_m.norm() < kMinDirectionLength_m) continue;
      if (bone_vector_m.dot(root_from_[above] * bone_vector_m) < kCosMaxBoneDeviation * bone_vector_m.squaredNorm())
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

  // Residual of one validation pose with the current or with the fitted model, each with its own optimal pose.
  void evaluate_next() {
    if (next_ >= 2 * validation_poses_.size()) return;
    const bool by_fit = next_ % 2 == 1;
    copy(validation_poses_.collected()[next_ / 2], evaluated_);
    const auto evaluated = fitter_.equations().optimise_pose(evaluated_, by_fit ? fitter_.offsets() : current_offsets_,
                                                             fitter_.cost(), kEvaluationSteps);
    (by_fit ? fitted_residual_m2_ : current_residual_m2_) += evaluated.data_m2;
    if (!by_fit) evaluated_markers_ += evaluated.weight;
    ++next_;
  }

  // Whether the residuals of the validation poses are lower by a fraction and by a length: a smaller gain is noise.
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
  bool has_known_bones_;  // those of the file are of the person, not only of people in general
  bodyfit::SubjectFitter fitter_;
  PoseCollection poses_;
  PoseCollection validation_poses_;
  std::vector<BodyInstant> instants_;  // of the fit in work
  BodyInstant instant_;
  BodyInstant evaluated_;
  std::vector<Eigen::Quaterniond> root_from_;  // scratch: by bone, rotation in the frame of the root
  bool is_refined_;                            // the body fits the person as far as skin allows
  bool has_offsets_;                           // the body model is of the person, not only of the file
  bool waiting_for_rest_ = false;
  bool has_new_rest_pose_ = false;
  std::optional<Timestamp> observed_at_;
  std::optional<Timestamp> began_at_;  // of the first block
  std::size_t new_pose_count_ = 0;
  std::size_t next_fit_count_ = kMinInstants;
  Stage stage_ = Stage::Gather;
  std::size_t next_ = 0;  // evaluation: two for each validation pose
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

void SubjectRefiner::archive(Archive& members) {
  for (SubjectRefinement& one : subjects_) members(one);
  members(next_subject_);
  if (next_subject_ >= std::max<std::size_t>(1, subjects_.size())) members.fail();
}

SubjectRefiner::~SubjectRefiner() = default;
SubjectRefiner::SubjectRefiner(SubjectRefiner&&) noexcept = default;

void SubjectRefiner::recognised(const SubjectFit& fit) {
  if (fit.subject.value < subjects_.size()) subjects_[fit.subject.value].recognised(fit);
}

void SubjectRefiner::forget(SubjectId subject) {
  if (subject.value < subjects_.size()) subjects_[subject.value].forget();
}

void SubjectRefiner::adopt(SubjectRefiner& before, const Handover& handover) {
  for (std::size_t i = 0; i < subjects_.size() && i < handover.subjects.size(); ++i) {
    const std::size_t from = handover.subjects[i].value;
    if (from < before.subjects_.size()) subjects_[i].adopt(before.subjects_[from]);
  }
}

std::optional<SubjectFit> SubjectRefiner::step(const Labels& labels, const Poses& poses, Timestamp at) {
  for (std::size_t i = 0; i < labels.size() && i < poses.size(); ++i) {
    const std::size_t subject = labels[i].subject.value;
    if (subject < subjects_.size()) subjects_[subject].observe(labels[i], poses[i], at);
  }
  // One subject at a time until its work is done, so that the time of a set does not grow with the number of subjects.
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
