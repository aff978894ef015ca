#include "bodyfit/subject_fitter.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::bodyfit {
namespace {

constexpr int kMaxIterations = 25;
constexpr int kMaxRejections = 6;
constexpr int kSteps = 3;          // Levenberg-Marquardt steps of a pose in one call of work()
constexpr int kInitialPasses = 3;  // calls of work() for each pose in the first iteration
// The fit ends if no offset changes by more than this,
constexpr double kConvergedOffset_m = 5e-5;
// or if the cost decreases by less than this fraction of it plus this amount.
constexpr double kMinRelativeGain = 1e-4;
constexpr double kMinGain = 0.05;
// Multiplications in one call of work(): about 20 us.
constexpr std::size_t kWorkUnit = 40'000;
// Prior of the standard deviation of a marker, with the weight of this number of coordinates; start and largest value.
constexpr double kPriorSigma_m = 0.002;
constexpr double kPriorSigmaWeight = 10.0;
constexpr double kInitialSigma_m = 0.004;
constexpr double kMostSigma_m = 0.015;
// Smallest redundancy (degrees of freedom per measured coordinate) for an estimate of the standard deviation.
constexpr double kMinFreeFraction = 0.15;
constexpr double kOutlierSigmas = 6.0;  // scale of the robust cost in estimated standard deviations

}  // namespace

SubjectFitter::SubjectFitter(const MarkerSet& file, const OffsetPriors& priors, std::size_t max_instants,
                             const OutlierScale& outliers)
    : instant_equations_(file),
      offset_equations_(file, instant_equations_.columns(), priors),
      outliers_(outliers),
      tried_(offsets_of(file)),
      best_(tried_),
      best_poses_(max_instants, std::vector<Pose>(file.skeleton.bones.size())) {}

void SubjectFitter::begin(const BodyOffsets& offsets, double size, std::span<BodyInstant> instants) {
  MOCAP_EXPECTS(instants.size() <= best_poses_.size());
  instants_ = instants;
  tried_.bones_m = offsets.bones_m;
  tried_.markers_m = offsets.markers_m;
  tried_size_ = size;
  seen_ = 0;
  for (const BodyInstant& instant : instants_) {
    for (std::size_t m = 0; m < instant.seen_m.size(); ++m) {
      seen_ += instant.seen_m[m].allFinite() && instant.trust[m] > 0.0 ? 3 : 0;
    }
  }
  cost_.sigma_m = kInitialSigma_m;
  cost_.outlier_m = outliers_.first_m;
  sum_ = best_sum_ = {};
  next_ = part_ = 0;
  pose_passes_ = 0;
  best_prior_ = changed_m_ = damping_ = 0.0;
  iterations_ = rejections_ = 0;
  improved_ = false;
  stage_ = instants_.empty() ? Stage::Done : Stage::OptimisePoses;
}

void SubjectFitter::archive(Archive& members) { members(cost_, best_, best_size_, rms_m_, iterations_, improved_); }

void SubjectFitter::archive_fit(Archive& members, std::span<BodyInstant> instants) {
  const std::size_t count = members.count(instants_.size(), std::min(instants.size(), best_poses_.size()));
  if (members.is_reading()) instants_ = instants.first(std::min(count, instants.size()));
  members(stage_, next_, part_, pose_passes_, tried_, tried_size_, sum_, best_sum_, best_prior_, seen_, damping_,
          changed_m_, rejections_);
  for (BodyInstant& instant : instants_) members(instant);
  // The first iteration writes the equations and the best poses.
  if (iterations_ > 0) {
    members(offset_equations_);
    for (std::size_t i = 0; i < instants_.size(); ++i) members(best_poses_[i]);
  }
  if (!members.is_reading()) return;
  check_fit(members);
  // The equations of the instant that is gathered.
  if (members.ok() && stage_ == Stage::Gather && part_ > 0)
    (void)instant_equations_.eliminate(instants_[next_], best_, cost_);
}

// The stage and the indices come from bytes.
void SubjectFitter::check_fit(Archive& members) const {
  const bool uses_next = stage_ == Stage::OptimisePoses || stage_ == Stage::Gather;
  if (stage_ < Stage::OptimisePoses || stage_ > Stage::Done || part_ >= instant_equations_.parts() ||
      (uses_next && next_ >= instants_.size()))
    members.fail();
}

bool SubjectFitter::work() {
  improved_ = false;
  switch (stage_) {
    case Stage::OptimisePoses:
      if (optimise_next_pose()) evaluate_iteration();
      break;
    case Stage::Gather: gather_next(); break;
    case Stage::Solve:
      if (!offset_equations_.work(kWorkUnit)) break;
      if (offset_equations_.solved()) {
        if (rejections_ == 0) estimate_noise();
        tried_ = best_;
        tried_size_ = best_size_;
        changed_m_ = offset_equations_.apply(tried_, tried_size_);
        next_ = 0;
        sum_ = {};
        stage_ = Stage::OptimisePoses;
      } else {
        reject();
      }
      break;
    case Stage::Done: break;
  }
  return stage_ == Stage::Done;
}

// Optimises the pose of one instant. Returns true after the last instant.
bool SubjectFitter::optimise_next_pose() {
  const auto pose_cost = instant_equations_.optimise_pose(instants_[next_], tried_, cost_, kSteps);
  if (iterations_ == 0 && ++pose_passes_ < kInitialPasses) return false;
  pose_passes_ = 0;
  sum_.data_m2 += pose_cost.data_m2;
  sum_.weight += pose_cost.weight;
  sum_.prior += pose_cost.prior;
  return ++next_ == instants_.size();
}

void SubjectFitter::evaluate_iteration() {
  const double prior = offset_equations_.prior_cost(tried_, tried_size_);
  const double cost = sum_.cost(cost_) + prior;
  const double before = best_sum_.cost(cost_) + best_prior_;
  if (!std::isfinite(cost) || (iterations_ > 0 && cost > before)) return reject();
  const bool small =
      iterations_ > 0 && (changed_m_ < kConvergedOffset_m || before - cost < kMinRelativeGain * before + kMinGain);
  best_prior_ = prior;
  accept();
  if (iterations_ > kMaxIterations || (small && iterations_ > 3)) stage_ = Stage::Done;
}

void SubjectFitter::accept() {
  improved_ = iterations_ > 0;
  ++iterations_;
  rejections_ = 0;
  damping_ = damping_ < 1e-4 ? 0.0 : 0.1 * damping_;
  best_ = tried_;
  best_size_ = tried_size_;
  best_sum_ = sum_;
  rms_m_ = std::sqrt(3.0 * sum_.data_m2 / static_cast<double>(std::max<std::size_t>(3, seen_)));
  for (std::size_t i = 0; i < instants_.size(); ++i) {
    std::copy(instants_[i].locals.begin(), instants_[i].locals.end(), best_poses_[i].begin());
  }
  offset_equations_.clear();
  sum_ = {};
  next_ = part_ = 0;
  stage_ = Stage::Gather;
}

// Estimates the standard deviation of a marker: residuals over degrees of freedom, with the prior.
void SubjectFitter::estimate_noise() {
  const double free =
      std::max(0.0, 3.0 * best_sum_.weight - best_sum_.observed_unknowns - offset_equations_.observed_unknowns());
  const double prior_sum = kPriorSigmaWeight * kPriorSigma_m * kPriorSigma_m;
  const double estimate_m = std::sqrt((best_sum_.data_m2 + prior_sum) / (free + kPriorSigmaWeight));
  // With little redundancy, the residuals are those of a fit that has not converged, not noise.
  const bool enough = free > kMinFreeFraction * 3.0 * best_sum_.weight;
  cost_.sigma_m = enough ? std::min(estimate_m, kMostSigma_m) : kPriorSigma_m;
  cost_.outlier_m = std::clamp(kOutlierSigmas * cost_.sigma_m, outliers_.least_m, cost_.outlier_m);
}

void SubjectFitter::reject() {
  for (std::size_t i = 0; iterations_ > 0 && i < instants_.size(); ++i) {
    std::copy(best_poses_[i].begin(), best_poses_[i].end(), instants_[i].locals.begin());
  }
  damping_ = std::max(1e-3, 10.0 * damping_);
  if (++rejections_ > kMaxRejections || iterations_ == 0) {
    stage_ = Stage::Done;
    return;
  }
  offset_equations_.begin_solve(damping_);
  stage_ = Stage::Solve;
}

void SubjectFitter::gather_next() {
  if (part_ == 0)
    sum_.observed_unknowns += instant_equations_.eliminate(instants_[next_], best_, cost_).observed_unknowns;
  // The first two nodes (the root) are coupled with all offsets: they take as long as all other nodes.
  const std::size_t half = part_ < 2 ? 2 : instant_equations_.parts();
  while (part_ < half) instant_equations_.add_to(part_++, offset_equations_.matrix(), offset_equations_.gradient());
  if (part_ < instant_equations_.parts()) return;
  part_ = 0;
  if (++next_ < instants_.size()) return;
  best_sum_.observed_unknowns = sum_.observed_unknowns;
  offset_equations_.add_priors(best_, best_size_);
  offset_equations_.begin_solve(damping_);
  stage_ = Stage::Solve;
}

}  // namespace mocap::bodyfit
