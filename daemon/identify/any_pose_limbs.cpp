// AnyPoseFinder, continued: the limbs of the best hypothesis are searched again, and their alternatives compared.

#include <algorithm>
#include <utility>

#include "identify/any_pose_finder.h"
#include "identify/detection_cost.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::identify {
namespace {

// Alternatives of a limb that are fitted, and the largest excess of their search cost over the best.
constexpr std::size_t kMaxAlternatives = 8;
constexpr double kAlternativeCostMargin = kMissedDetectionCost;
// How often an alternative may replace the best hypothesis.
constexpr std::size_t kMaxImprovements = 6;

}  // namespace

// Calls `visit` with each marker of these limbs. A marker in the joint of a bone is one of the neighbour, which stays.
template <typename Visit>
void AnyPoseFinder::visit_markers(const SearchPlan& limbs, Visit visit) const {
  for (const SearchStep& next : limbs) {
    for (const kinematics::ShapePoint& point : search_.shapes().of(static_cast<std::size_t>(next.bone)).points) {
      if ((point.position_m - next.joint_in_bone_m).norm() < kinematics::kInJoint_m) continue;
      visit(static_cast<std::size_t>(point.marker));
    }
  }
}

// A limb is a chain from an end of the tree up to the start bone or to a bone with two attached bones. One limb
// alone has the fewest alternatives; limbs that are attached to one bone may have exchanged their points.
void AnyPoseFinder::find_limbs(StartBone& start) const {
  const auto count_attached = [&](int bone) {
    return std::ranges::count_if(start.plan, [&](const SearchStep& next) { return next.from == bone; });
  };
  start.limb_of_marker.assign(set_.markers.size(), start.plan.size());  // of no limb
  std::vector<std::pair<int, SearchPlan>> attached;                     // by bone
  for (const SearchStep& end : start.plan) {
    if (count_attached(end.bone) > 0) continue;
    SearchPlan limb;
    int on = end.bone;
    while (on != start.bone && count_attached(on) < 2) {
      const SearchStep& entry = *std::ranges::find(start.plan, on, &SearchStep::bone);
      limb.insert(limb.begin(), entry);
      on = entry.from;
    }
    visit_markers(limb, [&](std::size_t marker) { start.limb_of_marker[marker] = start.limbs.size(); });
    start.limbs.push_back(limb);
    const auto known = std::ranges::find(attached, on, &std::pair<int, SearchPlan>::first);
    if (known == attached.end()) {
      attached.emplace_back(on, limb);
    } else {
      known->second.insert(known->second.end(), limb.begin(), limb.end());
    }
  }
  start.single_limbs = start.limbs.size();
  for (auto& [on, limbs] : attached) start.limbs.push_back(std::move(limbs));
}

const SearchPlan& AnyPoseFinder::reopened_limb() const {
  const std::vector<SearchPlan>& limbs = start_bones_[start_bone_].limbs;
  return limbs[limb_ % limbs.size()];
}

bool AnyPoseFinder::may_take_points() const { return limb_ >= start_bones_[start_bone_].limbs.size(); }

// Starts the search of a limb from the joints of the fitted body; all other bones stay.
void AnyPoseFinder::reopen_limb() {
  const std::size_t end = start_bones_[start_bone_].limbs.size() + start_bones_[start_bone_].single_limbs;
  while (limb_ < end && may_take_points() && !misses_a_marker(reopened_limb())) ++limb_;
  if (limb_ >= end) {
    describe();
    return;
  }
  without_limb_ = best_.hypothesis;
  without_limb_.cost = 0.0;
  visit_markers(reopened_limb(), [&](std::size_t marker) { without_limb_.point_of_marker[marker] = -1; });
  without_limb_.used.reset();
  for (const int p : without_limb_.point_of_marker) {
    if (p >= 0 && !may_take_points()) without_limb_.used.set(static_cast<std::size_t>(p));
  }
  search_.start(without_limb_, reopened_limb());
  stage_ = Stage::ReopenLimb;
}

// Whether a marker of the limb, or one in the joint to its neighbour, has no point in the best hypothesis.
bool AnyPoseFinder::misses_a_marker(const SearchPlan& limb) const {
  return std::ranges::any_of(limb, [&](const SearchStep& next) {
    const std::vector<kinematics::ShapePoint>& points = search_.shapes().of(static_cast<std::size_t>(next.bone)).points;
    return std::ranges::any_of(points, [&](const kinematics::ShapePoint& point) {
      return best_.hypothesis.point_of_marker[static_cast<std::size_t>(point.marker)] < 0;
    });
  });
}

// Takes each point that the alternative gives to a second marker away from the first, which has it in the best
// hypothesis.
void AnyPoseFinder::take_points(std::vector<int>& alternative) const {
  for (std::size_t m = 0; m < alternative.size(); ++m) {
    const int p = alternative[m];
    if (p >= 0 && p == best_.hypothesis.point_of_marker[m] && std::ranges::count(alternative, p) > 1)
      alternative[m] = -1;
  }
}

// Whether the alternative gives a point to a marker of another limb than the best hypothesis does.
bool AnyPoseFinder::exchanges_points(std::span<const int> alternative) const {
  const std::vector<int>& best = best_.hypothesis.point_of_marker;
  const std::vector<std::size_t>& limb_of = start_bones_[start_bone_].limb_of_marker;
  for (std::size_t m = 0; m < best.size(); ++m) {
    if (best[m] < 0 || alternative[m] == best[m]) continue;
    const auto now = std::ranges::find(alternative, best[m]);
    if (now != alternative.end() && limb_of[static_cast<std::size_t>(now - alternative.begin())] != limb_of[m])
      return true;
  }
  return false;
}

void AnyPoseFinder::begin_alternatives() {
  stage_ = Stage::Alternatives;
  next_ = tried_alternatives_ = 0;
  best_cost_ = search_.hypotheses().empty() ? 0.0 : search_.hypotheses().front().cost;
  for (const BodyPoseHypothesis& hypothesis : search_.hypotheses()) {
    if (hypothesis.point_of_marker == best_.hypothesis.point_of_marker) best_cost_ = hypothesis.cost;
  }
}

// Stores the differences of an alternative from the best hypothesis in `difference_`. Returns whether the alternative
// assigns another point to a marker; false if it only has fewer detections.
bool AnyPoseFinder::find_differences(std::span<const int> alternative) {
  difference_.clear();
  bool other = false;
  for (std::size_t m = 0; m < alternative.size(); ++m) {
    if (alternative[m] == best_.hypothesis.point_of_marker[m]) continue;
    difference_.emplace_back(static_cast<int>(m), alternative[m]);
    other = other || alternative[m] >= 0;
  }
  return other;
}

// Whether the difference includes one that already made an alternative much worse.
bool AnyPoseFinder::is_rejected() const {
  return std::any_of(rejected_differences_.begin(),
                     rejected_differences_.begin() + static_cast<std::ptrdiff_t>(rejected_count_),
                     [&](const Difference& rejected) {
                       return std::includes(difference_.begin(), difference_.end(), rejected.begin(), rejected.end());
                     });
}

void AnyPoseFinder::mark_ambiguous() {
  for (const auto& [marker, point] : difference_) is_ambiguous_[static_cast<std::size_t>(marker)] = true;
}

void AnyPoseFinder::evaluate_alternative() {
  const auto hypotheses = search_.hypotheses();
  if (next_ >= hypotheses.size() ||
      hypotheses[next_].cost > std::max(best_cost_, hypotheses[0].cost) + kAlternativeCostMargin) {
    ++limb_;
    reopen_limb();
    return;
  }
  alternative_.hypothesis = hypotheses[next_++];
  if (may_take_points()) take_points(alternative_.hypothesis.point_of_marker);
  // Other changes of a limb are among the alternatives of that limb alone.
  if (limb_ >= start_bones_[start_bone_].single_limbs && !exchanges_points(alternative_.hypothesis.point_of_marker))
    return;
  const bool other = find_differences(alternative_.hypothesis.point_of_marker);
  if (difference_.empty() || is_rejected()) return;
  if (!other || tried_alternatives_ >= kMaxAlternatives) {
    const double margin = other ? settings_.min_cost_margin : settings_.min_hidden_margin;
    if (!may_take_points() && alternative_.hypothesis.cost < best_cost_ + margin) mark_ambiguous();
    return;
  }
  ++tried_alternatives_;
  fit(alternative_);
  const bool same = alternative_.point_of_marker == best_.point_of_marker;
  if (!same && alternative_.cost < best_.cost && is_acceptable(alternative_) && improvements_ < kMaxImprovements) {
    ++improvements_;
    set_best(alternative_);
    reopen_limb();
  } else if (same || alternative_.cost > best_.cost + settings_.min_cost_margin) {
    if (rejected_count_ < rejected_differences_.size()) rejected_differences_[rejected_count_++] = difference_;
  } else if (!may_take_points()) {
    mark_ambiguous();
  }
}

}  // namespace mocap::identify
