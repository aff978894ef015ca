#include "identify/tpose_finder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/expects.h"
#include "identify/asymmetry.h"
#include "identify/detection_cost.h"
#include "kinematics/kinematic_tree.h"
#include "kinematics/rotation.h"

namespace mocap::identify {
namespace {

using geometry::UprightFit;

// Gate of the score of a placement, which is rigid and scaled: wide enough for arms that hang a little and for longer
// bones. Chosen by hand; not yet measured.
constexpr double kWideGate_m = 0.15;
// Standard deviation of a marker in a joint, and of a marker on the skin from its offset in the file.
// Chosen by hand; not yet measured.
constexpr double kTPoseJointSigma_m = 0.004;
constexpr double kTPoseSkinSigma_m = 0.010;
// Standard deviation of a joint from the rest pose for a person who holds that pose: 8 degrees. Chosen by
// hand; not yet measured.
constexpr double kPoseSigma_rad = 0.14;
// Largest height difference of a pair of points from the pair of markers: more is no T-pose. Chosen by hand; not yet
// measured.
constexpr double kMaxTilt_m = 0.3;
// Pairs of markers that propose placements. One marker is in few pairs, so that one hidden marker leaves others.
// Chosen by hand; not yet measured.
constexpr std::size_t kMaxAnchors = 12;
constexpr std::size_t kMaxAnchorUses = 4;
constexpr int kFitIterations = 12;
// Three standard deviations of a skin marker. A point that is farther from the fitted body gets no label.
constexpr double kMaxResidual_m = 0.03;

kinematics::PosePrior make_prior(std::span<const double> prior_sigma_rad) {
  return {.rest_sigma_rad = kPoseSigma_rad,
          .prior_sigma_rad = prior_sigma_rad,
          .prior_root_sigma_m = 10.0,
          .outlier_m = 0.10};
}

// The pairs of markers with the largest horizontal distances, at least half of the largest.
std::vector<std::pair<int, int>> wide_pairs(const std::vector<Eigen::Vector3d>& model) {
  struct Wide {
    double distance_m;
    int a, b;
  };
  std::vector<Wide> all;
  for (std::size_t a = 0; a < model.size(); ++a) {
    for (std::size_t b = a + 1; b < model.size(); ++b) {
      const double distance_m = (model[a] - model[b]).head<2>().norm();
      all.push_back({distance_m, static_cast<int>(a), static_cast<int>(b)});
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Wide& x, const Wide& y) { return x.distance_m > y.distance_m; });
  std::vector<std::size_t> uses(model.size());
  std::vector<std::pair<int, int>> chosen;
  for (const Wide& pair : all) {
    std::size_t& a = uses[static_cast<std::size_t>(pair.a)];
    std::size_t& b = uses[static_cast<std::size_t>(pair.b)];
    if (chosen.size() == kMaxAnchors || pair.distance_m < 0.5 * all.front().distance_m || a == kMaxAnchorUses ||
        b == kMaxAnchorUses)
      continue;
    ++a;
    ++b;
    chosen.emplace_back(pair.a, pair.b);
  }
  return chosen;
}

// The placement after half a turn about the vertical through the middle of the body.
UprightFit rotated_by_half_turn(const UprightFit& place, const Eigen::Vector3d& centre) {
  UprightFit half_turned = place;
  half_turned.yaw_rad += std::numbers::pi;
  half_turned.translation += place * centre - half_turned * centre;
  return half_turned;
}

bool is_same_placement(const UprightFit& a, const UprightFit& b, const Eigen::Vector3d& centre) {
  return std::cos(a.yaw_rad - b.yaw_rad) > 0.9 && (a * centre - b * centre).norm() < 0.15;
}

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(std::max<std::size_t>(1, points.size()));
}

}  // namespace

TPoseFinder::TPoseFinder(const MarkerSet& set, FindSettings settings, std::size_t max_points)
    : settings_(settings),
      max_points_(max_points),
      fit_(set, kinematics::PoseFit::Lengths::Free),
      assigner_(set.markers.size(), max_points, set.markers.size() * max_points) {
  MOCAP_EXPECTS(set.markers.size() <= kMaxLabels && set.skeleton.bones.size() <= kMaxBones);
  for (std::size_t m = 0; m < set.markers.size(); ++m) model_.push_back(fit_.marker_at(m));
  for (const MarkerPair& pair : set.asymmetric) {
    const Eigen::Vector3d off_m = asymmetry_m(model_[pair.one], model_[pair.other]);
    if (off_m.norm() >= kMinAsymmetry_m) asymmetries_.push_back({pair, off_m});  // a fit may have less than the file
  }
  anchors_ = wide_pairs(model_);
  hypotheses_.resize(proposals_.capacity() + 1);
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.point_of_marker.resize(model_.size());
  warped_.resize(model_.size());
  pairs_.reserve(model_.size() * max_points);
  matched_.reserve(model_.size());
  seen_.reserve(model_.size());
  // The root may rotate from its proposed rotation by 0.2 rad (1 sigma); the other bones have the rest-pose prior only.
  prior_sigma_rad_.assign(set.skeleton.bones.size(), 1e3);
  if (!prior_sigma_rad_.empty()) prior_sigma_rad_[0] = 0.2;
}

double TPoseFinder::score(const UprightFit& place, std::span<const Eigen::Vector3d> points) const {
  const double gate = kWideGate_m * kWideGate_m;
  double sum = 0.0;
  for (const Eigen::Vector3d& model : model_) {
    const Eigen::Vector3d at = place * model;
    double nearest = gate;
    for (const Eigen::Vector3d& point : points) nearest = std::min(nearest, (point - at).squaredNorm());
    sum += 1.0 - nearest / gate;
  }
  return sum;
}

// Keeps the best of the proposals with the same placement, and the best placements.
void TPoseFinder::keep_best(const Proposal& proposal) {
  const Eigen::Vector3d centre = mean_of(model_);
  for (Proposal& previous : proposals_) {
    if (!is_same_placement(previous.place, proposal.place, centre)) continue;
    if (previous.score < proposal.score) previous = proposal;
    return;
  }
  if (proposals_.try_push_back(proposal)) return;
  const auto worst = std::min_element(proposals_.begin(), proposals_.end(),
                                      [](const Proposal& a, const Proposal& b) { return a.score < b.score; });
  if (worst->score < proposal.score) *worst = proposal;
}

void TPoseFinder::propose(std::span<const Eigen::Vector3d> points) {
  proposals_.clear();
  for (const auto& [a, b] : anchors_) {
    const Eigen::Vector3d& from_a = model_[static_cast<std::size_t>(a)];
    const Eigen::Vector3d& from_b = model_[static_cast<std::size_t>(b)];
    const double distance_m = (from_a - from_b).norm();
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (std::size_t j = 0; j < points.size(); ++j) {
        const double scale = (points[i] - points[j]).norm() / distance_m;
        if (i == j || scale < settings_.min_scale || scale > settings_.max_scale) continue;
        if (std::abs((points[i] - points[j]).z() - scale * (from_a - from_b).z()) > kMaxTilt_m) continue;
        const std::array<geometry::PointPair, 2> pair{{{from_a, points[i]}, {from_b, points[j]}}};
        std::optional<UprightFit> place = geometry::fit_upright(pair);
        if (!place) continue;
        place->scale = scale;
        place->translation += 0.5 * (points[i] + points[j]) - *place * (0.5 * (from_a + from_b));
        keep_best({*place, score(*place, points)});
      }
    }
  }
}

void TPoseFinder::assign(std::span<const Eigen::Vector3d> points, double gate_m, Hypothesis& into) {
  pairs_.clear();
  for (std::size_t m = 0; m < warped_.size(); ++m) {
    for (std::size_t p = 0; p < points.size(); ++p) {
      const double off = (points[p] - warped_[m]).squaredNorm();
      if (off < gate_m * gate_m) pairs_.push_back({static_cast<std::uint32_t>(m), static_cast<std::uint32_t>(p), off});
    }
  }
  const auto columns = assigner_.assign(warped_.size(), points.size(), pairs_, gate_m * gate_m);
  into.matched = 0;
  for (std::size_t m = 0; m < warped_.size(); ++m) {
    into.point_of_marker[m] = columns[m] == geometry::Assigner::kUnassigned ? -1 : static_cast<int>(columns[m]);
    into.matched += columns[m] == geometry::Assigner::kUnassigned ? 0 : 1;
  }
}

// Fits the placement to the assigned points, then shifts each expected marker by the weighted mean residual of the
// markers around it. `reach_m` is the standard deviation of the Gaussian weight.
void TPoseFinder::warp_model(std::span<const Eigen::Vector3d> points, double reach_m, Hypothesis& into) {
  matched_.clear();
  for (std::size_t m = 0; m < model_.size(); ++m) {
    const int p = into.point_of_marker[m];
    if (p >= 0) matched_.push_back({model_[m], points[static_cast<std::size_t>(p)]});
  }
  const std::optional<UprightFit> place = geometry::fit_upright(matched_);
  if (place && place->scale > settings_.min_scale && place->scale < settings_.max_scale) into.place = *place;
  for (std::size_t m = 0; m < model_.size(); ++m) {
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();
    double weight = 0.2;  // a zero residual with this weight, so that one neighbour moves the marker in part only
    for (const geometry::PointPair& pair : matched_) {
      const double near = std::exp(-0.5 * (pair.from - model_[m]).squaredNorm() / (reach_m * reach_m));
      moved += near * (pair.to - into.place * pair.from);
      weight += near;
    }
    warped_[m] = into.place * model_[m] + moved / weight;
  }
}

void TPoseFinder::fit_body(std::span<const Eigen::Vector3d> points, Hypothesis& into) {
  seen_.clear();
  for (std::size_t m = 0; m < model_.size(); ++m) {
    const int p = into.point_of_marker[m];
    const bool in_joint = kinematics::sits_in_joint(fit_.marker_set().markers[m]);
    if (p >= 0)
      seen_.push_back({static_cast<int>(m), points[static_cast<std::size_t>(p)],
                       in_joint ? kTPoseJointSigma_m : kTPoseSkinSigma_m});
  }
  const Eigen::AngleAxisd heading(into.place.yaw_rad, Eigen::Vector3d::UnitZ());
  fit_.place({into.place.translation, Eigen::Quaterniond(heading)}, into.place.scale);
  const kinematics::PoseFitResult result = fit_.solve(seen_, make_prior(prior_sigma_rad_), kFitIterations);
  into.cost = result.cost + kMissedDetectionCost * static_cast<double>(model_.size() - seen_.size());
  into.rms_m = result.rms_m;
}

void TPoseFinder::evaluate_placement(const UprightFit& place, std::span<const Eigen::Vector3d> points,
                                     Hypothesis& into) {
  into.place = place;
  for (std::size_t m = 0; m < model_.size(); ++m) warped_[m] = place * model_[m];
  constexpr std::array<std::pair<double, double>, 4> kGateAndReach{
      {{0.18, 0.30}, {0.14, 0.22}, {0.10, 0.16}, {0.08, 0.12}}};
  for (const auto& [gate, reach] : kGateAndReach) {
    assign(points, gate, into);
    warp_model(points, reach, into);
  }
  assign(points, kGateAndReach.back().first, into);
  fit_body(points, into);
  for (std::size_t m = 0; m < model_.size(); ++m) warped_[m] = fit_.marker_at(m);
  assign(points, 0.06, into);
  fit_body(points, into);
  into.sides_swapped = has_swapped_sides(points, into);
  remove_outliers(points, into);
}

// Whether the asymmetry of the pairs points against that of the set, summed over all pairs. The positions are relative
// to the body, not to the bones: free bone lengths would absorb an exchange.
bool TPoseFinder::has_swapped_sides(std::span<const Eigen::Vector3d> points, const Hypothesis& hypothesis) const {
  const Eigen::AngleAxisd body_from_world(-hypothesis.place.yaw_rad, Eigen::Vector3d::UnitZ());
  const auto in_body = [&](int point) {
    return Eigen::Vector3d(body_from_world * (points[static_cast<std::size_t>(point)] - hypothesis.place.translation));
  };
  double along_m2 = 0.0;
  for (const auto& [pair, off_m] : asymmetries_) {
    const int one = hypothesis.point_of_marker[pair.one], other = hypothesis.point_of_marker[pair.other];
    if (one >= 0 && other >= 0) along_m2 += asymmetry_m(in_body(one), in_body(other)).dot(off_m);
  }
  return along_m2 < 0.0;
}

void TPoseFinder::remove_outliers(std::span<const Eigen::Vector3d> points, Hypothesis& into) {
  for (std::size_t m = 0; m < model_.size(); ++m) {
    int& p = into.point_of_marker[m];
    if (p < 0 || (points[static_cast<std::size_t>(p)] - fit_.marker_at(m)).norm() < kMaxResidual_m) continue;
    p = -1;
    --into.matched;
  }
}

// Whether two hypotheses are of one body: they share more than half of the points.
bool TPoseFinder::shares_points(const Hypothesis& a, const Hypothesis& b) const {
  int shared = 0;
  for (const int p : a.point_of_marker) {
    if (p >= 0 && std::find(b.point_of_marker.begin(), b.point_of_marker.end(), p) != b.point_of_marker.end()) ++shared;
  }
  return 2 * shared > std::min(a.matched, b.matched);
}

bool TPoseFinder::is_in_pose() const {
  return std::all_of(fit_.locals().begin() + 1, fit_.locals().end(), [&](const Pose& local) {
    return kinematics::rotation_vector(local.rotation).norm() <= settings_.max_joint_angle_rad;
  });
}

void TPoseFinder::describe(const Hypothesis& best, std::span<const Eigen::Vector3d> points, double margin) {
  found_.emplace();
  found_->rms_m = best.rms_m;
  found_->margin = margin;
  found_->matched = best.matched;
  const MarkerSet& set = fit_.marker_set();
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    const Bone& bone = set.skeleton.bones[b];
    found_->rest_offsets_m.push_back(bone.parent < 0 ? bone.rest_offset_m : fit_.locals()[b].position);
  }
  for (std::size_t m = 0; m < model_.size(); ++m) {
    const int p = best.point_of_marker[m];
    found_->point_of_marker.push_back(p);
    Eigen::Vector3d offset = best.place.scale * set.markers[m].offset_m;
    if (p >= 0 && !kinematics::sits_in_joint(set.markers[m])) {
      const Pose& bone = fit_.world()[static_cast<std::size_t>(set.markers[m].bone)];
      offset = bone.inverse() * points[static_cast<std::size_t>(p)];
    }
    found_->marker_offsets_m.push_back(offset);
  }
}

TPoseOutcome TPoseFinder::judge(const Hypothesis& best, double margin) const {
  if (best.matched < settings_.min_marker_fraction * static_cast<double>(model_.size())) {
    return TPoseOutcome::TooFewMatched;
  }
  const double missed_cost = kMissedDetectionCost * static_cast<double>(static_cast<int>(model_.size()) - best.matched);
  const double max_cost = settings_.max_cost_fraction * kMissedDetectionCost * best.matched;
  if (best.rms_m > settings_.max_rms_m || best.cost - missed_cost > max_cost) return TPoseOutcome::TooInexact;
  const bool is_ambiguous = best.sides_swapped || margin < settings_.min_margin || margin < 0.25 * best.cost;
  return is_ambiguous ? TPoseOutcome::Ambiguous : TPoseOutcome::Found;
}

void TPoseFinder::describe_attempt(const Hypothesis& best) {
  attempt_.matched = best.matched;
  attempt_.rms_m = best.rms_m;
  for (std::size_t m = 0; m < model_.size(); ++m) {
    attempt_.point_of_marker.push_back(best.point_of_marker[m]);
    attempt_.expected.push_back({best.place * model_[m]});
  }
}

const std::optional<FoundBody>& TPoseFinder::find(std::span<const Eigen::Vector3d> points) {
  found_.reset();
  attempt_ = {};
  points = points.first(std::min(points.size(), max_points_));
  const double needed = settings_.min_marker_fraction * static_cast<double>(model_.size());
  if (model_.size() < 4 || static_cast<double>(points.size()) < needed) return found_;
  propose(points);
  attempt_.outcome = TPoseOutcome::NoPlacement;
  if (proposals_.empty()) return found_;

  std::size_t best = 0;
  for (std::size_t i = 0; i < proposals_.size(); ++i) {
    evaluate_placement(proposals_[i].place, points, hypotheses_[i]);
    if (hypotheses_[i].cost < hypotheses_[best].cost) best = i;
  }
  const Eigen::Vector3d centre = mean_of(model_);
  Hypothesis& half_turned = hypotheses_[proposals_.size()];
  evaluate_placement(rotated_by_half_turn(hypotheses_[best].place, centre), points, half_turned);
  if (half_turned.cost < hypotheses_[best].cost) best = proposals_.size();

  double next = 1e12;
  for (std::size_t i = 0; i <= proposals_.size(); ++i) {
    const Hypothesis& other = hypotheses_[i];
    const bool differs = other.point_of_marker != hypotheses_[best].point_of_marker;
    if (i != best && differs && shares_points(other, hypotheses_[best])) next = std::min(next, other.cost);
  }
  Hypothesis& chosen = hypotheses_[best];
  const double margin = next - chosen.cost;
  describe_attempt(chosen);
  attempt_.outcome = judge(chosen, margin);
  if (attempt_.outcome != TPoseOutcome::Found) return found_;
  fit_body(points, chosen);
  if (is_in_pose()) {
    describe(chosen, points, margin);
  } else {
    attempt_.outcome = TPoseOutcome::BentJoints;
  }
  return found_;
}

}  // namespace mocap::identify
