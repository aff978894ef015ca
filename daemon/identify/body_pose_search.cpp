#include "identify/body_pose_search.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "base/expects.h"
#include "kinematics/joint_prior.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::identify {
namespace {

// Hypotheses in the beam: with 96, as many labels are wrong (decision 0006). Largest excess of their cost over the
// best: two missed detections and a residual of two standard deviations; chosen by hand, not yet measured.
constexpr std::size_t kBeamWidth = 32;
constexpr double kBeamCostMargin = 18.0;
// Hypotheses with equal continuations. Chosen by hand; not yet measured.
constexpr std::size_t kMaxEquivalent = 6;
// Proposals for the first bone, and extended hypotheses of one step. Chosen by hand; not yet measured.
constexpr std::size_t kMaxSeeds = 24;
constexpr std::size_t kMaxExpansions = 320;
// Largest standard deviation of a joint from which a bone is searched: with one marker, with two markers, and with
// markers that determine the bone's rotation. Chosen by hand; not yet measured.
constexpr double kMaxJointSigma_m[] = {0.12, 0.20, 0.35};
// Standard deviation of the far end of a bone with an unobserved rotation axis, as a fraction of the lever: joints
// rotate by 35 degrees rms.
constexpr double kUnseenLeverFraction = 0.6;
// Largest cost of a joint beyond its range: 4.9 standard deviations. Chosen by hand; not yet measured.
constexpr double kMaxRangeCost = 12.0;

// Whether each of these points, some of which may be negative, is one of `count` points.
bool is_within(std::span<const int> points, std::size_t count) {
  return std::ranges::all_of(points, [&](int point) { return point < static_cast<int>(count); });
}

}  // namespace

BodyPoseSearch::BodyPoseSearch(const MarkerSet& set) : set_(set), shapes_(set) {
  const std::size_t bones = set.skeleton.bones.size();
  BodyPoseHypothesis hypothesis;
  hypothesis.point_of_marker.assign(set.markers.size(), -1);
  hypothesis.bones.resize(bones);
  hypotheses_.assign(kBeamWidth, hypothesis);
  previous_hypotheses_ = hypotheses_;
  seeds_.reserve(kMaxSeeds);
  expansions_.reserve(kMaxExpansions);
}

void BodyPoseSearch::refit(const MarkerSet& set) {
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b)
    set_.skeleton.bones[b].rest_offset_m = set.skeleton.bones[b].rest_offset_m;
  for (std::size_t m = 0; m < set.markers.size(); ++m) set_.markers[m].offset_m = set.markers[m].offset_m;
  shapes_.refit(set_);
}

// Depth first. Neighbours whose markers determine their rotation come first: the joints beyond them are then well
// known. `open` is a stack, so these neighbours are pushed last.
SearchPlan BodyPoseSearch::plan_from(int root, bool last_first) const {
  SearchPlan plan;
  std::vector<SearchStep> open;
  const auto open_neighbours = [&](int bone, int from) {
    std::vector<kinematics::ShapeJoint> joints = shapes_.of(static_cast<std::size_t>(bone)).joints;
    if (last_first) std::ranges::reverse(joints);
    for (const bool determined : {false, true}) {
      for (const kinematics::ShapeJoint& joint : joints) {
        if (joint.bone == from || shapes_.determines_rotation(static_cast<std::size_t>(joint.bone)) != determined)
          continue;
        open.push_back({joint.bone, bone, joint.joint_in_neighbour_m, joint.joint_in_bone_m});
      }
    }
  };
  open_neighbours(root, -1);
  while (!open.empty()) {
    const SearchStep next = open.back();
    open.pop_back();
    plan.push_back(next);
    open_neighbours(next.bone, next.from);
  }
  return plan;
}

void BodyPoseSearch::refit(SearchPlan& plan) const {
  for (SearchStep& next : plan) {
    for (const kinematics::ShapeJoint& joint : shapes_.of(static_cast<std::size_t>(next.bone)).joints) {
      if (joint.bone != next.from) continue;
      next.joint_in_bone_m = joint.joint_in_bone_m;
      next.joint_in_neighbour_m = joint.joint_in_neighbour_m;
    }
  }
}

void BodyPoseSearch::begin(const pose::PointCloud& cloud, const BodyUncertainty& uncertainty,
                           double clutter_density_1_m3) {
  cloud_ = &cloud;
  uncertainty_ = uncertainty;
  proposer_.set({.marker_sigma_m = uncertainty.marker_sigma_m, .clutter_density_1_m3 = clutter_density_1_m3});
  count_ = 0;
  expansions_.clear();
}

void BodyPoseSearch::start(int root, const SearchPlan& plan) {
  MOCAP_EXPECTS(cloud_ != nullptr);
  plan_ = &plan;
  root_ = root;
  next_ = step_ = count_ = 0;
  seeds_.clear();
  expansions_.clear();
}

void BodyPoseSearch::start(const BodyPoseHypothesis& hypothesis, const SearchPlan& plan) {
  MOCAP_EXPECTS(cloud_ != nullptr);
  plan_ = &plan;
  root_ = -1;
  next_ = step_ = 0;
  hypotheses_[0] = hypothesis;
  count_ = 1;
  expansions_.clear();
}

bool BodyPoseSearch::expand() {
  if (root_ >= 0) return seed_root();
  if (step_ >= plan_->size() || count_ == 0) return true;
  expand(next_);
  if (++next_ >= count_) prune_beam();
  return step_ >= plan_->size();
}

bool BodyPoseSearch::seed_root() {
  if (next_ < cloud_->size()) {
    proposer_.propose_from_points(shapes_.of(static_cast<std::size_t>(root_)), *cloud_, next_++, kMaxSeeds, seeds_);
    return false;
  }
  std::sort(seeds_.begin(), seeds_.end(),
            [](const pose::BoneProposal& a, const pose::BoneProposal& b) { return a.cost < b.cost; });
  for (const pose::BoneProposal& seed : seeds_) {
    BodyPoseHypothesis& hypothesis = hypotheses_[count_++];
    hypothesis.used.reset();
    std::fill(hypothesis.point_of_marker.begin(), hypothesis.point_of_marker.end(), -1);
    apply_expansion(hypothesis, {seed.cost, 0, 0.0, seed}, root_, Eigen::Vector3d::Zero());
  }
  root_ = -1;
  next_ = 0;
  return step_ >= plan_->size() || count_ == 0;
}

void BodyPoseSearch::apply_expansion(BodyPoseHypothesis& into, const Expansion& expansion, int bone,
                                     const Eigen::Vector3d& joint_m) const {
  into.cost = expansion.cost;
  const auto b = static_cast<std::size_t>(bone);
  into.bones[b] = {expansion.bone.world_from_bone, expansion.bone.dof, expansion.bone.axis, joint_m,
                   expansion.joint_sigma_m};
  const auto& points = shapes_.of(b).points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int p = expansion.bone.point_of[i];
    if (p < 0) continue;
    into.point_of_marker[static_cast<std::size_t>(points[i].marker)] = p;
    into.used.set(static_cast<std::size_t>(p));
  }
}

// Position and standard deviation of the joint. A detected marker that sits in the joint gives both; otherwise the
// neighbour's pose does.
pose::JointAnchor BodyPoseSearch::make_anchor(const BodyPoseHypothesis& hypothesis, const SearchStep& next) const {
  const pose::BonePoseHypothesis& from = hypothesis.bones[static_cast<std::size_t>(next.from)];
  pose::JointAnchor anchor;
  anchor.joint_m = next.joint_in_bone_m;
  anchor.anchor_m = from.world * next.joint_in_neighbour_m;
  anchor.rest = from.world.rotation;
  const Eigen::Vector3d lever = next.joint_in_neighbour_m - from.joint_m;
  anchor.sigma_m = uncertainty_.joint_sigma_m;
  if (from.dof == pose::Dof::Swing) {
    const double across = (lever - from.axis * from.axis.dot(lever)).norm();
    anchor.sigma_m = std::hypot(anchor.sigma_m, kUnseenLeverFraction * across);
  } else if (from.dof == pose::Dof::None) {
    anchor.sigma_m = std::hypot(from.joint_sigma_m, kUnseenLeverFraction * lever.norm());
  }
  for (const kinematics::ShapePoint& point : shapes_.of(static_cast<std::size_t>(next.bone)).points) {
    const int p = hypothesis.point_of_marker[static_cast<std::size_t>(point.marker)];
    if (p < 0 || (point.position_m - next.joint_in_bone_m).norm() > kinematics::kInJoint_m) continue;
    anchor.anchor_m = (*cloud_)[static_cast<std::size_t>(p)];
    anchor.sigma_m = uncertainty_.marker_sigma_m;
  }
  return anchor;
}

double BodyPoseSearch::range_cost(const BodyPoseHypothesis& hypothesis, const SearchStep& next,
                                  const pose::BoneProposal& proposal) const {
  const pose::BonePoseHypothesis& from = hypothesis.bones[static_cast<std::size_t>(next.from)];
  if (from.dof != pose::Dof::Full || proposal.dof != pose::Dof::Full) return 0.0;
  const bool is_child = set_.skeleton.bones[static_cast<std::size_t>(next.bone)].parent == next.from;
  const Eigen::Quaterniond& upper = is_child ? from.world.rotation : proposal.world_from_bone.rotation;
  const Eigen::Quaterniond& lower = is_child ? proposal.world_from_bone.rotation : from.world.rotation;
  const Bone& bone = set_.skeleton.bones[static_cast<std::size_t>(is_child ? next.bone : next.from)];
  return 0.5 * pose::squared_range_excess(bone, upper.conjugate() * lower) /
         (kinematics::kRangeSigma_rad * kinematics::kRangeSigma_rad);
}

void BodyPoseSearch::expand(std::size_t index) {
  const BodyPoseHypothesis& hypothesis = hypotheses_[index];
  const SearchStep& next = (*plan_)[step_];
  const kinematics::BoneShape& shape = shapes_.of(static_cast<std::size_t>(next.bone));
  const pose::JointAnchor from = make_anchor(hypothesis, next);
  Expansion expansion{hypothesis.cost, index, from.sigma_m, {}};
  const std::size_t observability = shapes_.determines_rotation(static_cast<std::size_t>(next.bone)) ? 2
                                    : shape.points.size() > 1                                        ? 1
                                                                                                     : 0;
  if (from.sigma_m > kMaxJointSigma_m[observability]) {
    expansion.bone.world_from_bone = {from.anchor_m - from.rest * from.joint_m, from.rest};
    expansion.bone.point_of.resize(shape.points.size());
    std::fill(expansion.bone.point_of.begin(), expansion.bone.point_of.end(), -1);
    if (expansions_.size() < kMaxExpansions) expansions_.push_back(expansion);
    return;
  }
  for (const pose::BoneProposal& proposal :
       proposer_.propose_from_joint(shape, from, *cloud_, hypothesis.used, hypothesis.point_of_marker)) {
    const double range_excess_cost = range_cost(hypothesis, next, proposal);
    if (range_excess_cost > kMaxRangeCost || expansions_.size() == kMaxExpansions) continue;
    expansion.bone = proposal;
    expansion.cost = hypothesis.cost + proposal.cost + range_excess_cost;
    expansions_.push_back(expansion);
  }
}

// Whether two hypotheses agree in all bones to which the later steps attach a bone.
bool BodyPoseSearch::are_equivalent(const BodyPoseHypothesis& a, const BodyPoseHypothesis& b) const {
  for (std::size_t i = step_ + 1; i < plan_->size(); ++i) {
    const auto from = static_cast<std::size_t>((*plan_)[i].from);
    const bool later = std::any_of(plan_->begin() + static_cast<std::ptrdiff_t>(step_) + 1,
                                   plan_->begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const SearchStep& next) { return next.bone == static_cast<int>(from); });
    if (later) continue;
    for (const kinematics::ShapePoint& point : shapes_.of(from).points) {
      const auto m = static_cast<std::size_t>(point.marker);
      if (a.point_of_marker[m] != b.point_of_marker[m]) return false;
    }
  }
  return true;
}

void BodyPoseSearch::prune_beam() {
  std::sort(expansions_.begin(), expansions_.end(), [](const Expansion& a, const Expansion& b) {
    return a.cost != b.cost ? a.cost < b.cost : a.hypothesis < b.hypothesis;
  });
  hypotheses_.swap(previous_hypotheses_);
  count_ = 0;
  const SearchStep& next = (*plan_)[step_];
  const bool last = step_ + 1 == plan_->size();
  for (const Expansion& expansion : expansions_) {
    if (count_ == kBeamWidth || expansion.cost > expansions_.front().cost + kBeamCostMargin) break;
    BodyPoseHypothesis& into = hypotheses_[count_];
    into = previous_hypotheses_[expansion.hypothesis];
    apply_expansion(into, expansion, next.bone, next.joint_in_bone_m);
    std::size_t same = 0;
    for (std::size_t i = 0; i < count_ && same < kMaxEquivalent; ++i) {
      if (hypotheses_[i].point_of_marker == into.point_of_marker) same = kMaxEquivalent;
      if (!last && are_equivalent(hypotheses_[i], into)) ++same;
    }
    if (same < kMaxEquivalent) ++count_;
  }
  expansions_.clear();
  next_ = 0;
  ++step_;
}

void BodyPoseSearch::archive(Archive& members) {
  members(proposer_, root_, next_, step_, count_, seeds_, expansions_);
  if (count_ > hypotheses_.size()) members.fail();
  if (!members.ok()) return;
  for (BodyPoseHypothesis& hypothesis : std::span(hypotheses_).first(count_)) members(hypothesis);
  if (members.is_reading() && !has_valid_indices()) members.fail();
}

bool BodyPoseSearch::fits(const pose::BoneProposal& proposal, int bone) const {
  return proposal.point_of.size() == shapes_.of(static_cast<std::size_t>(bone)).points.size() &&
         is_within(proposal.point_of, cloud_->size());
}

// Whether the members that were read refer to existing points, hypotheses and bones.
bool BodyPoseSearch::has_valid_indices() const {
  if (root_ >= static_cast<int>(shapes_.size()) || (root_ >= 0 && count_ > 0)) return false;
  const bool extends = root_ < 0 && step_ < plan_->size();
  if ((extends && count_ > 0 && next_ >= count_) || (!extends && !expansions_.empty())) return false;
  return std::ranges::all_of(seeds_, [&](const auto& seed) { return root_ < 0 || fits(seed, root_); }) &&
         std::ranges::all_of(hypotheses(),
                             [&](const auto& one) { return is_within(one.point_of_marker, cloud_->size()); }) &&
         std::ranges::all_of(expansions_, [&](const Expansion& one) {
           return one.hypothesis < count_ && fits(one.bone, (*plan_)[step_].bone);
         });
}

}  // namespace mocap::identify
