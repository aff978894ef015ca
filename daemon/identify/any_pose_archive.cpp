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
  members(cloud_, uncertainty_, is_last_round_, is_reverse_, start_bone_, next_, limb_, work_at_begin_, fit_work_,
          fitted_, fits_, best_);
  members(best_cost_, rejected_differences_, rejected_count_, tried_alternatives_, improvements_, is_ambiguous_);
  if (members.is_reading() && !has_valid_indices()) members.fail();
  if (!members.ok()) return;
  if (members.is_reading()) resume_search();
  members(search_);
}

// Gives the points and the plan of the search that is read to `search_`.
void AnyPoseFinder::resume_search() {
  const StartBone& start = start_bones_[start_bone_];
  begin_search();
  const SearchPlan& plan = is_reverse_ ? start.reverse : start.plan;
  search_.start(start.bone, stage_ < Stage::ReopenLimb ? plan : reopened_limb());
}

// Whether the members that were read refer to existing points, hypotheses and bones.
bool AnyPoseFinder::has_valid_indices() const {
  const auto exist = [&](const std::vector<int>& points) {
    return std::ranges::all_of(points, [&](int point) { return point < static_cast<int>(cloud_.size()); });
  };
  if (stage_ > Stage::Alternatives || start_bone_ >= start_bones_.size() || fits_ > fitted_.size() ||
      rejected_count_ > rejected_differences_.size())
    return false;
  if (stage_ == Stage::Search || stage_ == Stage::Fit) {
    // Those that are not fitted yet have points of an earlier search.
    const std::span<const Fitted> chosen = std::span(fitted_).first(fits_);
    const std::size_t fitted = stage_ == Stage::Fit ? next_ : fits_;
    return (stage_ == Stage::Search || next_ < fits_) &&
           std::ranges::all_of(
               chosen, exist,
               [](const Fitted& one) -> const std::vector<int>& { return one.hypothesis.point_of_marker; }) &&
           std::ranges::all_of(chosen.first(fitted), exist, &Fitted::point_of_marker);
  }
  const StartBone& start = start_bones_[start_bone_];
  return limb_ < start.limbs.size() + start.single_limbs && exist(best_.point_of_marker) &&
         exist(best_.hypothesis.point_of_marker);
}

}  // namespace mocap::identify
