#include "identify/any_pose_finder.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::identify {
namespace {

constexpr std::size_t kMostRoots = 4;
// Readings of the whole body that are judged by its fit.
constexpr std::size_t kMostFits = 4;
// Readings of a bone's limbs that are, and how much worse than the best they may have looked.
constexpr std::size_t kMostChallenges = 8;
constexpr double kChallenge = 12.0;
constexpr std::size_t kMostChanges = 6;
// What a fit counts a marker that is not there; how far off its place a point may be; when it hardly pulls.
constexpr double kCostOfMissing = 8.0;
constexpr double kFitGate_m = 0.04;
constexpr double kOutlier_m = 0.05;
// How hard a joint's range is: people reach beyond it by a little.
constexpr double kRange_rad = 0.3;
constexpr double kRestShare = 0.5;
constexpr int kFirstIterations = 10;
constexpr int kSecondIterations = 5;
// What an iteration of the whole body costs, in fits of a bone.
constexpr std::size_t kWorkOfIteration = 25;
// Points far off do not say how many lie about the body: they are reckoned to be in so much room.
constexpr double kBodyRoom_m3 = 4.0;

int differ(std::span<const int> a, std::span<const int> b) {
  int count = 0;
  for (std::size_t m = 0; m < a.size(); ++m) count += a[m] != b[m] && a[m] >= 0 && b[m] >= 0 ? 1 : 0;
  return count;
}

}  // namespace

AnyPoseFinder::AnyPoseFinder(const MarkerSet& set, const FindAnyPoseSettings& settings)
    : settings_(settings),
      set_(set),
      layer_(set),
      fit_(set, kinematics::PoseFit::Lengths::Fixed),
      assigner_(set.markers.size(), pose::kMostCloudPoints, set.markers.size() * pose::kMostCloudPoints) {
  const std::size_t bones = set.skeleton.bones.size(), markers = set.markers.size();
  MOCAP_EXPECTS(markers <= kMaxLabels && bones <= kMaxBones);
  for (std::size_t b = 0; b < bones; ++b) {
    if (layer_.shapes().tells_turn(b)) roots_.push_back({static_cast<int>(b), {}, {}});
  }
  // The more markers, the surer; then the more bones hang there.
  const auto rank = [&](const Root& root) {
    const kinematics::BoneShape& shape = layer_.shapes().of(static_cast<std::size_t>(root.bone));
    return std::min<std::size_t>(4, shape.points.size()) * 16 + shape.joints.size();
  };
  std::stable_sort(roots_.begin(), roots_.end(), [&](const Root& a, const Root& b) { return rank(a) > rank(b); });
  if (roots_.size() > kMostRoots) roots_.resize(kMostRoots);
  for (Root& root : roots_) {
    root.plan = layer_.plan_from(root.bone);
    root.limbs = limbs_of(root.bone, root.plan);
  }
  Fitted fitted;
  fitted.reading.point_of_marker.assign(markers, -1);
  fitted.reading.bones.resize(bones);
  fitted.point_of_marker.resize(markers);
  fitted.locals.resize(bones);
  fitted_.assign(kMostFits, fitted);
  best_ = rival_ = fitted;
  rest_ = fitted.reading;
  difference_.reserve(markers);
  dismissed_.resize(kMostChallenges);
  for (Difference& difference : dismissed_) difference.reserve(markers);
  unsure_.resize(markers);
  seen_.reserve(markers);
  pairs_.reserve(markers * pose::kMostCloudPoints);
  locals_.resize(bones);
}

// Chains of bones that end somewhere, gathered by the bone that they hang on.
std::vector<LayPlan> AnyPoseFinder::limbs_of(int root, const LayPlan& plan) const {
  const auto hung_on = [&](int bone) {
    return std::count_if(plan.begin(), plan.end(), [&](const NextBone& next) { return next.from == bone; });
  };
  const auto entry_of = [&](int bone) {
    return std::find_if(plan.begin(), plan.end(), [&](const NextBone& next) { return next.bone == bone; });
  };
  std::vector<std::pair<int, LayPlan>> limbs;
  for (const NextBone& end : plan) {
    if (hung_on(end.bone) > 0) continue;
    LayPlan chain;
    int on = end.bone;
    while (on != root && hung_on(on) < 2) {
      const NextBone& entry = *entry_of(on);
      chain.insert(chain.begin(), entry);
      on = entry.from;
    }
    const auto known = std::find_if(limbs.begin(), limbs.end(), [&](const auto& limb) { return limb.first == on; });
    if (known == limbs.end()) {
      limbs.emplace_back(on, chain);
    } else {
      known->second.insert(known->second.end(), chain.begin(), chain.end());
    }
  }
  std::vector<LayPlan> plans;
  for (auto& limb : limbs) plans.push_back(std::move(limb.second));
  return plans;
}

void AnyPoseFinder::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                          std::span<const Eigen::Vector3d> marker_offsets_m) {
  stage_ = Stage::Idle;
  fit_.refit(rest_offsets_m, marker_offsets_m);
  for (std::size_t b = 0; b < rest_offsets_m.size(); ++b) set_.skeleton.bones[b].rest_offset_m = rest_offsets_m[b];
  for (std::size_t m = 0; m < marker_offsets_m.size(); ++m) set_.markers[m].offset_m = marker_offsets_m[m];
  layer_.refit(set_);
  for (Root& root : roots_) {
    layer_.refit(root.plan);
    for (LayPlan& limb : root.limbs) layer_.refit(limb);
  }
}

void AnyPoseFinder::begin(std::span<const Eigen::Vector3d> points) {
  cloud_.take(points);
  found_.reset();
  fit_work_ = 0;
  begun_at_ = layer_.work();
  stage_ = Stage::Idle;
  const double needed = settings_.least_seen * static_cast<double>(set_.markers.size());
  if (roots_.empty() || static_cast<double>(cloud_.size()) < needed) return;
  rough_ = false;
  begin_round(settings_.well);
}

void AnyPoseFinder::begin_round(const BodyKnown& known) {
  known_ = known;
  root_ = 0;
  // To a limb the markers of all others are strays, too.
  layer_.begin(cloud_, known_, static_cast<double>(cloud_.size()) / kBodyRoom_m3);
  layer_.start(roots_[root_].bone, roots_[root_].plan);
  stage_ = Stage::Lay;
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
    case Stage::Lay:
      if (layer_.grow()) choose_fits();
      return;
    case Stage::Fit:
      fit(fitted_[next_]);
      if (++next_ >= fits_) judge();
      return;
    case Stage::Relay:
      if (layer_.grow()) begin_challenge();
      return;
    case Stage::Challenge: challenge(); return;
  }
}

// The best reading, and the best that are other readings of the body.
void AnyPoseFinder::choose_fits() {
  fits_ = 0;
  next_ = 0;
  const int apart = std::max(2, static_cast<int>(set_.markers.size() / 8));
  for (const BodyReading& reading : layer_.readings()) {
    if (fits_ == kMostFits) break;
    const bool same = std::any_of(
        fitted_.begin(), fitted_.begin() + static_cast<std::ptrdiff_t>(fits_),
        [&](const Fitted& other) { return differ(reading.point_of_marker, other.reading.point_of_marker) < apart; });
    if (!same) fitted_[fits_++].reading = reading;
  }
  stage_ = Stage::Fit;
  if (fits_ == 0) judge();
}

void AnyPoseFinder::assign(Fitted& into) {
  pairs_.clear();
  constexpr double kGate2 = kFitGate_m * kFitGate_m;
  for (std::size_t m = 0; m < set_.markers.size(); ++m) {
    const Eigen::Vector3d at = fit_.marker_at(m);
    for (std::size_t p = 0; p < cloud_.size(); ++p) {
      const double off = (cloud_[p] - at).squaredNorm();
      if (off < kGate2) pairs_.push_back({static_cast<std::uint32_t>(m), static_cast<std::uint32_t>(p), off});
    }
  }
  const auto columns = assigner_.assign(set_.markers.size(), cloud_.size(), pairs_, kGate2);
  for (std::size_t m = 0; m < set_.markers.size(); ++m)
    into.point_of_marker[m] = columns[m] == geometry::Assigner::kAlone ? -1 : static_cast<int>(columns[m]);
}

void AnyPoseFinder::solve(Fitted& into, int iterations) {
  seen_.clear();
  for (std::size_t m = 0; m < into.point_of_marker.size(); ++m) {
    const int p = into.point_of_marker[m];
    if (p >= 0) seen_.push_back({static_cast<int>(m), cloud_[static_cast<std::size_t>(p)], known_.marker_sigma_m});
  }
  kinematics::PosePrior prior;
  prior.rest_share = kRestShare;
  prior.limit_sigma_rad = kRange_rad;
  prior.outlier_m = kOutlier_m;
  const kinematics::PoseFitResult result = fit_.solve(seen_, prior, iterations);
  fit_work_ += kWorkOfIteration * static_cast<std::size_t>(result.iterations);
  into.cost = result.cost + kCostOfMissing * static_cast<double>(set_.markers.size() - seen_.size());
  into.rms_m = result.rms_m;
  into.matched = static_cast<int>(seen_.size());
}

void AnyPoseFinder::fit(Fitted& into) {
  pose::untwist(set_.skeleton, into.reading.bones);
  pose::to_locals(set_.skeleton, into.reading.bones, locals_);
  fit_.set_locals(locals_);
  into.point_of_marker = into.reading.point_of_marker;
  solve(into, kFirstIterations);
  assign(into);
  solve(into, kSecondIterations);
  std::copy(fit_.locals().begin(), fit_.locals().end(), into.locals.begin());
  // From here on the reading has its bones where the whole body has them.
  for (std::size_t b = 0; b < locals_.size(); ++b) into.reading.bones[b].world = fit_.world()[b];
}

bool AnyPoseFinder::good(const Fitted& one) const {
  return one.matched >= settings_.least_seen * static_cast<double>(set_.markers.size()) &&
         one.rms_m <= settings_.most_rms * known_.marker_sigma_m;
}

void AnyPoseFinder::judge() {
  const auto end = fitted_.begin() + static_cast<std::ptrdiff_t>(fits_);
  const auto best =
      std::min_element(fitted_.begin(), end, [](const Fitted& a, const Fitted& b) { return a.cost < b.cost; });
  if (best == end || !good(*best)) {
    go_on();
    return;
  }
  best_ = *best;
  margin_ = 1e9;
  std::fill(unsure_.begin(), unsure_.end(), false);
  for (auto other = fitted_.begin(); other != end; ++other) {
    if (other == best || differ(other->point_of_marker, best->point_of_marker) == 0) continue;
    margin_ = std::min(margin_, other->cost - best->cost);
    (void)tell_difference(other->point_of_marker);
    if (other->cost < best->cost + settings_.sure) doubt();
  }
  limb_ = 0;
  changes_ = 0;
  relay();
}

// The next bone to begin with; then all of them with wider bounds.
void AnyPoseFinder::go_on() {
  stage_ = Stage::Idle;
  if (++root_ < roots_.size()) {
    layer_.start(roots_[root_].bone, roots_[root_].plan);
    stage_ = Stage::Lay;
  } else if (!rough_) {
    rough_ = true;
    begin_round(settings_.roughly);
  }
}

// Takes the limbs off and lays them anew, from where the whole body has their joints.
void AnyPoseFinder::relay() {
  if (limb_ >= roots_[root_].limbs.size()) {
    describe();
    return;
  }
  rest_ = best_.reading;
  rest_.cost = 0.0;
  for (const NextBone& next : roots_[root_].limbs[limb_]) {
    for (const kinematics::ShapePoint& point : layer_.shapes().of(static_cast<std::size_t>(next.bone)).points) {
      if ((point.at_m - next.here_m).norm() < 1e-3) continue;  // belongs to what it hangs on, too
      rest_.point_of_marker[static_cast<std::size_t>(point.marker)] = -1;
    }
  }
  rest_.taken.reset();
  for (const int p : rest_.point_of_marker) {
    if (p >= 0) rest_.taken.set(static_cast<std::size_t>(p));
  }
  layer_.start(rest_, roots_[root_].limbs[limb_]);
  stage_ = Stage::Relay;
}

void AnyPoseFinder::begin_challenge() {
  stage_ = Stage::Challenge;
  next_ = challenges_ = dismissals_ = 0;
  own_cost_ = layer_.readings().empty() ? 0.0 : layer_.readings().front().cost;
  for (const BodyReading& reading : layer_.readings()) {
    if (reading.point_of_marker == best_.reading.point_of_marker) own_cost_ = reading.cost;
  }
}

// Notes what a rival has otherwise; whether it gives any marker another point, rather than none.
bool AnyPoseFinder::tell_difference(std::span<const int> rival) {
  difference_.clear();
  bool other = false;
  for (std::size_t m = 0; m < rival.size(); ++m) {
    if (rival[m] == best_.reading.point_of_marker[m]) continue;
    difference_.emplace_back(static_cast<int>(m), rival[m]);
    other = other || rival[m] >= 0;
  }
  return other;
}

// Whether the difference holds one that made a rival much worse alone.
bool AnyPoseFinder::dismissed() const {
  return std::any_of(dismissed_.begin(), dismissed_.begin() + static_cast<std::ptrdiff_t>(dismissals_),
                     [&](const Difference& known) {
                       return std::includes(difference_.begin(), difference_.end(), known.begin(), known.end());
                     });
}

void AnyPoseFinder::doubt() {
  for (const auto& [marker, point] : difference_) unsure_[static_cast<std::size_t>(marker)] = true;
}

void AnyPoseFinder::challenge() {
  const auto readings = layer_.readings();
  if (next_ >= readings.size() || readings[next_].cost > std::max(own_cost_, readings[0].cost) + kChallenge) {
    ++limb_;
    relay();
    return;
  }
  const BodyReading& rival = readings[next_++];
  const bool other = tell_difference(rival.point_of_marker);
  if (difference_.empty() || dismissed()) return;
  if (!other || challenges_ >= kMostChallenges) {
    if (rival.cost < own_cost_ + (other ? settings_.sure : settings_.surely_seen)) doubt();
    return;
  }
  ++challenges_;
  rival_.reading = rival;
  fit(rival_);
  const bool same = rival_.point_of_marker == best_.point_of_marker;
  if (!same && rival_.cost < best_.cost && good(rival_) && changes_ < kMostChanges) {
    ++changes_;
    std::swap(best_, rival_);
    limb_ = 0;
    std::fill(unsure_.begin(), unsure_.end(), false);
    relay();
  } else if (same || rival_.cost > best_.cost + settings_.sure) {
    if (dismissals_ < dismissed_.size()) dismissed_[dismissals_++] = difference_;
    if (!same) margin_ = std::min(margin_, rival_.cost - best_.cost);
  } else {
    margin_ = std::min(margin_, rival_.cost - best_.cost);
    doubt();
  }
}

// A name is given where all readings that are about as likely give it.
void AnyPoseFinder::describe() {
  stage_ = Stage::Idle;
  found_.emplace();
  found_->rms_m = best_.rms_m;
  found_->cost = best_.cost;
  found_->margin = margin_;
  found_->explained = best_.matched;
  for (std::size_t m = 0; m < set_.markers.size(); ++m) {
    const int p = best_.point_of_marker[m];
    const bool sure = p >= 0 && p == best_.reading.point_of_marker[m] && !unsure_[m];
    found_->point_of_marker.push_back(sure ? p : -1);
    found_->matched += sure ? 1 : 0;
  }
  for (const Pose& local : best_.locals) found_->locals.push_back(local);
  if (found_->matched < settings_.least_share * static_cast<double>(set_.markers.size())) found_.reset();
}

}  // namespace mocap::identify
