// AnyPoseFinder, continued: the fit of the whole body to one hypothesis.

#include <algorithm>
#include <utility>

#include "identify/any_pose_finder.h"
#include "identify/detection_cost.h"
#include "pose/bone_pose_hypothesis.h"

namespace mocap::identify {
namespace {

// Largest distance between a marker of the fitted body and its point; scale of the robust cost of the fit.
constexpr double kAssignmentGate_m = 0.04;
constexpr double kFitOutlier_m = 0.05;
// End of a fit. A smaller step, 1e-5, gave 2160 random bodies (decision 0006) the same number of right and wrong
// labels.
constexpr kinematics::PoseFitEnd kFitEnd{.max_iterations = 10, .small_step = 1e-3};
// Work of one iteration of the fit of the whole body, in bone fits.
constexpr std::size_t kIterationWork = 25;

}  // namespace

void AnyPoseFinder::assign(std::vector<int>& point_of_marker) {
  pairs_.clear();
  constexpr double kGate2 = kAssignmentGate_m * kAssignmentGate_m;
  for (std::size_t m = 0; m < set_.markers.size(); ++m) {
    const Eigen::Vector3d at = fit_.marker_at(m);
    for (std::size_t p = 0; p < cloud_.size(); ++p) {
      const double off = (cloud_[p] - at).squaredNorm();
      if (off < kGate2) pairs_.push_back({static_cast<std::uint32_t>(m), static_cast<std::uint32_t>(p), off});
    }
  }
  const auto columns = assigner_.assign(set_.markers.size(), cloud_.size(), pairs_, kGate2);
  for (std::size_t m = 0; m < set_.markers.size(); ++m)
    point_of_marker[m] = columns[m] == geometry::Assigner::kUnassigned ? -1 : static_cast<int>(columns[m]);
}

// Fits the body to its points, from the pose of `fit_`.
void AnyPoseFinder::solve(BodyFit& into) {
  seen_.clear();
  for (std::size_t m = 0; m < into.point_of_marker.size(); ++m) {
    const int p = into.point_of_marker[m];
    if (p >= 0)
      seen_.push_back({static_cast<int>(m), cloud_[static_cast<std::size_t>(p)], uncertainty_.marker_sigma_m});
  }
  kinematics::PosePrior prior;
  prior.rest_range_fraction = kinematics::kRestRangeFraction;
  prior.limit_sigma_rad = kinematics::kRangeSigma_rad;
  prior.outlier_m = kFitOutlier_m;
  const kinematics::PoseFitResult result = fit_.solve(seen_, prior, kFitEnd);
  fit_work_ += kIterationWork * static_cast<std::size_t>(result.iterations);
  into.cost = result.cost + kMissedDetectionCost * static_cast<double>(set_.markers.size() - seen_.size());
  into.rms_m = result.rms_m;
  into.matched = static_cast<int>(seen_.size());
  std::ranges::copy(fit_.locals(), into.locals.begin());
}

// Fits the body to the points of the hypothesis, and then to the points that are nearest to the fitted markers: the
// search may have left a marker out. The new points are kept unless they cost more than those of the hypothesis.
void AnyPoseFinder::fit(Fitted& into) {
  pose::resolve_twist(set_.skeleton, into.hypothesis.bones);
  pose::to_local_poses(set_.skeleton, into.hypothesis.bones, locals_);
  fit_.set_locals(locals_);
  into.point_of_marker = into.hypothesis.point_of_marker;
  solve(into);
  assign(reassigned_.point_of_marker);
  if (reassigned_.point_of_marker != into.point_of_marker) {
    solve(reassigned_);
    if (reassigned_.cost <= into.cost) std::swap<BodyFit>(into, reassigned_);
    fit_.set_locals(into.locals);
  }
  // A later search of a limb starts from the joints of the fitted body.
  for (std::size_t b = 0; b < locals_.size(); ++b) into.hypothesis.bones[b].world = fit_.world()[b];
}

bool AnyPoseFinder::is_acceptable(const Fitted& one) const {
  const auto markers = static_cast<double>(set_.markers.size());
  return one.matched >= settings_.min_present_fraction * markers &&
         one.cost <= settings_.max_cost_fraction * kMissedDetectionCost * markers &&
         one.rms_m <= settings_.max_rms_sigmas * uncertainty_.marker_sigma_m;
}

}  // namespace mocap::identify
