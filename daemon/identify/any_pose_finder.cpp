#include "identify/any_pose_finder.h"

#include <algorithm>

#include "base/expects.h"
#include "identify/detection_cost.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::identify {
namespace {

constexpr std::size_t kMaxStartBones = 4;
// Hypotheses of one search that are fitted as a whole body.
constexpr std::size_t kMaxFits = 4;
// Alternatives of a limb that are fitted, and the largest excess of their search cost over the best.
constexpr std::size_t kMaxAlternatives = 8;
constexpr double kAlternativeCostMargin = kMissedDetectionCost;
// How often an alternative may replace the best hypothesis.
constexpr std::size_t kMaxImprovements = 6;
constexpr std::size_t kMaxRejectedDifferences = 64;
// The clutter density is the number of points divided by this volume. The extent of the points themselves is no
// measure: a few distant points would make the density near the body too small.
constexpr double kClutterVolume_m3 = 4.0;

// Markers of `a` with a point that has another marker, or whose marker has another point, in `b`.
int count_differences(std::span<const int> a, std::span<const int> b) {
  int count = 0;
  for (std::size_t m = 0; m < a.size(); ++m) {
    if (a[m] < 0 || a[m] == b[m]) continue;
    count += b[m] >= 0 || std::ranges::find(b, a[m]) != b.end() ? 1 : 0;
  }
  return count;
}

}  // namespace

AnyPoseFinder::AnyPoseFinder(const MarkerSet& set, const FindAnyPoseSettings& settings)
    : settings_(settings),
      set_(set),
      search_(set),
      fit_(set, kinematics::PoseFit::Lengths::Fixed),
      assigner_(set.markers.size(), pose::kMaxCloudPoints, set.markers.size() * pose::kMaxCloudPoints) {
  const std::size_t bones = set.skeleton.bones.size(), markers = set.markers.size();
  MOCAP_EXPECTS(markers <= kMaxLabels && bones <= kMaxBones);
  for (std::size_t b = 0; b < bones; ++b) {
    if (search_.shapes().determines_rotation(b)) start_bones_.push_back({static_cast<int>(b), {}, {}, {}, 0, {}});
  }
  // Bones with more markers (up to 4) have fewer false proposals; then bones with more joints come first.
  const auto rank = [&](const StartBone& start) {
    const kinematics::BoneShape& shape = search_.shapes().of(static_cast<std::size_t>(start.bone));
    return std::min<std::size_t>(4, shape.points.size()) * 16 + shape.joints.size();
  };
  std::stable_sort(start_bones_.begin(), start_bones_.end(),
                   [&](const StartBone& a, const StartBone& b) { return rank(a) > rank(b); });
  if (start_bones_.size() > kMaxStartBones) start_bones_.resize(kMaxStartBones);
  for (StartBone& start : start_bones_) {
    start.plan = search_.plan_from(start.bone);
    start.reverse = search_.plan_from(start.bone, true);
    find_limbs(start);
  }
  Fitted fitted;
  fitted.hypothesis.point_of_marker.assign(markers, -1);
  fitted.hypothesis.bones.resize(bones);
  fitted.point_of_marker.resize(markers);
  fitted.locals.resize(bones);
  fitted_.assign(2 * kMaxFits, fitted);
  best_ = alternative_ = fitted;
  reassigned_ = fitted;
  without_limb_ = fitted.hypothesis;
  difference_.reserve(markers);
  rejected_differences_.resize(kMaxRejectedDifferences);
  for (Difference& difference : rejected_differences_) difference.reserve(markers);
  is_ambiguous_.resize(markers);
  seen_.reserve(markers);
  pairs_.reserve(markers * pose::kMaxCloudPoints);
  locals_.resize(bones);
}

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

void AnyPoseFinder::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                          std::span<const Eigen::Vector3d> marker_offsets_m) {
  stage_ = Stage::Idle;
  fit_.refit(rest_offsets_m, marker_offsets_m);
  for (std::size_t b = 0; b < rest_offsets_m.size(); ++b) set_.skeleton.bones[b].rest_offset_m = rest_offsets_m[b];
  for (std::size_t m = 0; m < marker_offsets_m.size(); ++m) set_.markers[m].offset_m = marker_offsets_m[m];
  refit_search();
}

// Takes over the offsets of `set_`.
void AnyPoseFinder::refit_search() {
  search_.refit(set_);
  for (StartBone& start : start_bones_) {
    search_.refit(start.plan);
    search_.refit(start.reverse);
    for (SearchPlan& limb : start.limbs) search_.refit(limb);
  }
}

void AnyPoseFinder::begin(std::span<const Eigen::Vector3d> points) {
  cloud_.assign(points);
  found_.reset();
  fit_work_ = 0;
  work_at_begin_ = search_.work();
  stage_ = Stage::Idle;
  const double needed = settings_.min_present_fraction * static_cast<double>(set_.markers.size());
  if (start_bones_.empty() || static_cast<double>(cloud_.size()) < needed) return;
  is_coarse_ = false;
  begin_round(settings_.precise);
}

void AnyPoseFinder::begin_round(const BodyUncertainty& uncertainty) {
  uncertainty_ = uncertainty;
  start_bone_ = 0;
  begin_search();
  search_from_start_bone();
}

void AnyPoseFinder::search_from_start_bone() {
  is_reverse_ = false;
  fits_ = 0;
  search_.start(start_bones_[start_bone_].bone, start_bones_[start_bone_].plan);
  stage_ = Stage::Search;
}

// All points count as clutter: for one limb, so do the markers of the other limbs.
void AnyPoseFinder::begin_search() {
  search_.begin(cloud_, uncertainty_, static_cast<double>(cloud_.size()) / kClutterVolume_m3);
}

bool AnyPoseFinder::advance(std::size_t work) {
  const std::size_t until = this->work() + work;
  while (stage_ != Stage::Idle && this->work() < until) step();
  return stage_ == Stage::Idle;
}

const std::optional<FoundPose>& AnyPoseFinder::find(std::span<const Eigen::Vector3d> points) {
  begin(points);
  while (stage_ != Stage::Idle) step();
  return found_;
}

void AnyPoseFinder::step() {
  ++fit_work_;
  switch (stage_) {
    case Stage::Idle: return;
    case Stage::Search:
      if (search_.expand()) choose_fits();
      return;
    case Stage::Fit:
      fit(fitted_[next_]);
      if (++next_ >= fits_) select_best();
      return;
    case Stage::ReopenLimb:
      if (search_.expand()) begin_alternatives();
      return;
    case Stage::Alternatives: evaluate_alternative(); return;
  }
}

// Selects the hypotheses to fit: the best, and the best of those that differ from every selected one in at least an
// eighth of the markers.
void AnyPoseFinder::choose_fits() {
  next_ = fits_;
  const int min_difference = std::max(2, static_cast<int>(set_.markers.size() / 8));
  for (const BodyPoseHypothesis& hypothesis : search_.hypotheses()) {
    if (fits_ == next_ + kMaxFits) break;
    const bool same = std::ranges::any_of(std::span(fitted_).first(fits_), [&](const Fitted& other) {
      return count_differences(hypothesis.point_of_marker, other.hypothesis.point_of_marker) < min_difference;
    });
    if (!same) fitted_[fits_++].hypothesis = hypothesis;
  }
  stage_ = Stage::Fit;
  if (fits_ == next_) select_best();
}

void AnyPoseFinder::select_best() {
  const auto end = fitted_.begin() + static_cast<std::ptrdiff_t>(fits_);
  const auto best =
      std::min_element(fitted_.begin(), end, [](const Fitted& a, const Fitted& b) { return a.cost < b.cost; });
  if (best == end || !is_acceptable(*best)) {
    next_start_bone();
    return;
  }
  // The beam compares hypotheses after equally many bones. Where the first limbs of the plan are hidden, the right
  // hypothesis has fewer points, and is pruned although its points come later.
  if (!is_reverse_ && best->matched < static_cast<int>(set_.markers.size())) {
    is_reverse_ = true;
    search_.start(start_bones_[start_bone_].bone, start_bones_[start_bone_].reverse);
    stage_ = Stage::Search;
    return;
  }
  improvements_ = 0;
  set_best(*best);
  for (auto other = fitted_.begin(); other != end; ++other) {
    if (other == best || count_differences(other->point_of_marker, best_.point_of_marker) == 0) continue;
    (void)find_differences(other->point_of_marker);
    if (other->cost < best_.cost + settings_.min_cost_margin) mark_ambiguous();
  }
  reopen_limb();
}

// Makes this the best hypothesis, whose limbs are all to be searched again.
void AnyPoseFinder::set_best(Fitted& best) {
  std::swap(best_, best);
  std::fill(is_ambiguous_.begin(), is_ambiguous_.end(), false);
  limb_ = rejected_count_ = 0;
}

// Starts the search from the next start bone; after the last one, the coarse round.
void AnyPoseFinder::next_start_bone() {
  stage_ = Stage::Idle;
  if (++start_bone_ < start_bones_.size()) {
    search_from_start_bone();
  } else if (!is_coarse_) {
    is_coarse_ = true;
    begin_round(settings_.coarse);
  }
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

// Assigns points to the markers that are not ambiguous.
void AnyPoseFinder::describe() {
  stage_ = Stage::Idle;
  found_.emplace();
  found_->rms_m = best_.rms_m;
  found_->cost = best_.cost;
  found_->explained = best_.matched;
  for (std::size_t m = 0; m < set_.markers.size(); ++m) {
    const int p = best_.point_of_marker[m];
    const bool is_certain = p >= 0 && p == best_.hypothesis.point_of_marker[m] && !is_ambiguous_[m];
    found_->point_of_marker.push_back(is_certain ? p : -1);
    found_->matched += is_certain ? 1 : 0;
  }
  for (const Pose& local : best_.locals) found_->locals.push_back(local);
  if (found_->matched < settings_.min_labelled_fraction * static_cast<double>(set_.markers.size())) found_.reset();
}

}  // namespace mocap::identify
