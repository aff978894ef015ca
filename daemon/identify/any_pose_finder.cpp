#include "identify/any_pose_finder.h"

#include <algorithm>
#include <utility>

#include "base/expects.h"

namespace mocap::identify {
namespace {

constexpr std::size_t kMaxStartBones = 4;
// Hypotheses of one search that are fitted as a whole body.
constexpr std::size_t kMaxFits = 4;
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
  if (!set_points(points)) return;
  is_last_round_ = false;
  begin_round(settings_.precise);
}

void AnyPoseFinder::begin(std::span<const Eigen::Vector3d> points, const BodyUncertainty& uncertainty) {
  if (!set_points(points)) return;
  is_last_round_ = true;
  begin_round(uncertainty);
}

// Whether the points may be enough for the body.
bool AnyPoseFinder::set_points(std::span<const Eigen::Vector3d> points) {
  cloud_.assign(points);
  found_.reset();
  fit_work_ = 0;
  work_at_begin_ = search_.work();
  stage_ = Stage::Idle;
  const double needed = settings_.min_present_fraction * static_cast<double>(set_.markers.size());
  return !start_bones_.empty() && static_cast<double>(cloud_.size()) >= needed;
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
  } else if (!is_last_round_) {
    is_last_round_ = true;
    begin_round(settings_.coarse);
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
