#include <algorithm>
#include <span>
#include <utility>

#include "identify/any_pose_finder.h"
#include "kinematics/archive_body.h"

namespace mocap::identify {

void AnyPoseFinder::adopt(AnyPoseFinder& before) {
  *this = std::move(before);
  search_.follow(cloud_);
}

void AnyPoseFinder::archive(Archive& members) {
  kinematics::archive_offsets(set_, members);
  members(fit_, found_, stage_);
  if (members.is_reading()) refit_search();
  if (stage_ == Stage::Idle) return;  // `begin` sets all other members
  members(cloud_, uncertainty_, is_coarse_, root_, next_, limb_, work_at_begin_, fit_work_, fitted_, fits_, best_);
  members(best_cost_, rejected_differences_, rejected_count_, tried_alternatives_, improvements_, is_ambiguous_);
  if (members.is_reading() && !has_valid_indices()) members.fail();
  if (!members.ok()) return;
  if (members.is_reading()) resume_search();
  members(search_);
}

// Gives the points and the plan of the search that is read to `search_`.
void AnyPoseFinder::resume_search() {
  const Root& root = roots_[root_];
  begin_search();
  search_.start(root.bone, stage_ < Stage::ReopenLimb ? root.plan : reopened_limb());
}

// Whether the members that were read refer to existing points, hypotheses and bones.
bool AnyPoseFinder::has_valid_indices() const {
  const auto has_points = [&](const Fitted& one) {
    const auto exists = [&](int point) { return point < static_cast<int>(cloud_.size()); };
    return std::ranges::all_of(one.point_of_marker, exists) &&
           std::ranges::all_of(one.hypothesis.point_of_marker, exists);
  };
  if (stage_ > Stage::Alternatives || root_ >= roots_.size() || fits_ > fitted_.size() ||
      rejected_count_ > rejected_differences_.size())
    return false;
  if (stage_ == Stage::Fit) return next_ < fits_ && std::ranges::all_of(std::span(fitted_).first(fits_), has_points);
  const Root& root = roots_[root_];
  return stage_ == Stage::Search || (limb_ < root.limbs.size() + root.single_limbs && has_points(best_));
}

}  // namespace mocap::identify
