#include "identify/body_pose_search.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::identify {
namespace {

// Readings that are followed at once, and by how much of log-likelihood they may be worse than the best.
constexpr std::size_t kMostReadings = 32;
constexpr double kMostBehind = 18.0;
constexpr std::size_t kMostAlike = 6;
constexpr std::size_t kMostSeeds = 24;
constexpr std::size_t kMostGrowths = 320;
// A joint that is less sure than this tells nothing of a bone with one marker, two markers, or more that tell its turn.
constexpr double kLostJoint_m[] = {0.12, 0.20, 0.35};
// By what share of its lever an unseen or half-seen bone's end is unsure: joints that turn by 35 degrees, rms.
constexpr double kUnseenTurn = 0.6;
// How hard a joint's range is: bones that are told by markers 8 cm apart are turned by 0.1 rad, and people reach
// beyond.
constexpr double kRange_rad = 0.3;
constexpr double kMostBeyond = 12.0;
constexpr double kInJoint_m = 1e-3;

}  // namespace

BodyLayer::BodyLayer(const MarkerSet& set) : set_(set), shapes_(set) {
  const std::size_t bones = set.skeleton.bones.size();
  BodyReading reading;
  reading.point_of_marker.assign(set.markers.size(), -1);
  reading.bones.resize(bones);
  readings_.assign(kMostReadings, reading);
  before_ = readings_;
  seeds_.reserve(kMostSeeds);
  growths_.reserve(kMostGrowths);
}

void BodyLayer::refit(const MarkerSet& set) {
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b)
    set_.skeleton.bones[b].rest_offset_m = set.skeleton.bones[b].rest_offset_m;
  for (std::size_t m = 0; m < set.markers.size(); ++m) set_.markers[m].offset_m = set.markers[m].offset_m;
  shapes_.refit(set_);
}

// Depth first; of a bone's neighbours those first that tell their turn themselves, for what hangs there is then sure.
LayPlan BodyLayer::plan_from(int root) const {
  LayPlan plan;
  std::vector<NextBone> open;
  const auto open_neighbours = [&](int bone, int from) {
    for (const bool telling : {false, true}) {
      for (const kinematics::ShapeJoint& joint : shapes_.of(static_cast<std::size_t>(bone)).joints) {
        if (joint.bone == from || shapes_.tells_turn(static_cast<std::size_t>(joint.bone)) != telling) continue;
        open.push_back({joint.bone, bone, joint.there_m, joint.here_m});
      }
    }
  };
  open_neighbours(root, -1);
  while (!open.empty()) {
    const NextBone next = open.back();
    open.pop_back();
    plan.push_back(next);
    open_neighbours(next.bone, next.from);
  }
  return plan;
}

void BodyLayer::refit(LayPlan& plan) const {
  for (NextBone& next : plan) {
    for (const kinematics::ShapeJoint& joint : shapes_.of(static_cast<std::size_t>(next.bone)).joints) {
      if (joint.bone != next.from) continue;
      next.here_m = joint.here_m;
      next.there_m = joint.there_m;
    }
  }
}

void BodyLayer::begin(const pose::BodyCloud& cloud, const BodyKnown& known, double strays_1_m3) {
  cloud_ = &cloud;
  known_ = known;
  layer_.set({.marker_sigma_m = known.marker_sigma_m, .strays_1_m3 = strays_1_m3});
  count_ = 0;
  growths_.clear();
}

void BodyLayer::start(int root, const LayPlan& plan) {
  MOCAP_EXPECTS(cloud_ != nullptr);
  plan_ = &plan;
  root_ = root;
  next_ = turn_ = count_ = 0;
  seeds_.clear();
  growths_.clear();
}

void BodyLayer::start(const BodyReading& reading, const LayPlan& plan) {
  MOCAP_EXPECTS(cloud_ != nullptr);
  plan_ = &plan;
  root_ = -1;
  next_ = turn_ = 0;
  readings_[0] = reading;
  count_ = 1;
  growths_.clear();
}

bool BodyLayer::grow() {
  if (root_ >= 0) return seed();
  if (turn_ >= plan_->size() || count_ == 0) return true;
  grow(next_);
  if (++next_ >= count_) take_best();
  return turn_ >= plan_->size();
}

bool BodyLayer::seed() {
  if (next_ < cloud_->size()) {
    layer_.seed(shapes_.of(static_cast<std::size_t>(root_)), *cloud_, next_++, kMostSeeds, seeds_);
    return false;
  }
  std::sort(seeds_.begin(), seeds_.end(), [](const pose::LaidBone& a, const pose::LaidBone& b) { return a.cost < b.cost; });
  for (const pose::LaidBone& seed : seeds_) {
    BodyReading& reading = readings_[count_++];
    reading.taken.reset();
    std::fill(reading.point_of_marker.begin(), reading.point_of_marker.end(), -1);
    adopt(reading, {seed.cost, 0, 0.0, seed}, root_, Eigen::Vector3d::Zero());
  }
  root_ = -1;
  next_ = 0;
  return turn_ >= plan_->size() || count_ == 0;
}

void BodyLayer::adopt(BodyReading& into, const Growth& growth, int bone, const Eigen::Vector3d& joint_m) const {
  into.cost = growth.cost;
  const auto b = static_cast<std::size_t>(bone);
  into.bones[b] = {growth.bone.world_from_bone, growth.bone.laid, growth.bone.axis, joint_m, growth.joint_sigma_m};
  const auto& points = shapes_.of(b).points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int p = growth.bone.point_of[i];
    if (p < 0) continue;
    into.point_of_marker[static_cast<std::size_t>(points[i].marker)] = p;
    into.taken.set(static_cast<std::size_t>(p));
  }
}

// Where the joint is, and how surely; a marker that sits in it and was seen tells it.
pose::LayFrom BodyLayer::hang(const BodyReading& reading, const NextBone& next) const {
  const pose::BoneReading& from = reading.bones[static_cast<std::size_t>(next.from)];
  pose::LayFrom hang;
  hang.joint_m = next.here_m;
  hang.place_m = from.world * next.there_m;
  hang.rest = from.world.rotation;
  const Eigen::Vector3d lever = next.there_m - from.joint_m;
  hang.sigma_m = known_.joint_sigma_m;
  if (from.laid == pose::Laid::Swung) {
    const double across = (lever - from.axis * from.axis.dot(lever)).norm();
    hang.sigma_m = std::hypot(hang.sigma_m, kUnseenTurn * across);
  } else if (from.laid == pose::Laid::Unseen) {
    hang.sigma_m = std::hypot(from.joint_sigma_m, kUnseenTurn * lever.norm());
  }
  for (const kinematics::ShapePoint& point : shapes_.of(static_cast<std::size_t>(next.bone)).points) {
    const int p = reading.point_of_marker[static_cast<std::size_t>(point.marker)];
    if (p < 0 || (point.at_m - next.here_m).norm() > kInJoint_m) continue;
    hang.place_m = (*cloud_)[static_cast<std::size_t>(p)];
    hang.sigma_m = known_.marker_sigma_m;
  }
  return hang;
}

double BodyLayer::beyond_range(const BodyReading& reading, const NextBone& next, const pose::LaidBone& laid) const {
  const pose::BoneReading& from = reading.bones[static_cast<std::size_t>(next.from)];
  if (from.laid != pose::Laid::Turned || laid.laid != pose::Laid::Turned) return 0.0;
  const bool down = set_.skeleton.bones[static_cast<std::size_t>(next.bone)].parent == next.from;
  const Eigen::Quaterniond& upper = down ? from.world.rotation : laid.world_from_bone.rotation;
  const Eigen::Quaterniond& lower = down ? laid.world_from_bone.rotation : from.world.rotation;
  const Bone& bone = set_.skeleton.bones[static_cast<std::size_t>(down ? next.bone : next.from)];
  return 0.5 * pose::beyond_range2(bone, upper.conjugate() * lower) / (kRange_rad * kRange_rad);
}

void BodyLayer::grow(std::size_t index) {
  const BodyReading& reading = readings_[index];
  const NextBone& next = (*plan_)[turn_];
  const kinematics::BoneShape& shape = shapes_.of(static_cast<std::size_t>(next.bone));
  const pose::LayFrom from = hang(reading, next);
  Growth growth{reading.cost, index, from.sigma_m, {}};
  const std::size_t telling = shapes_.tells_turn(static_cast<std::size_t>(next.bone)) ? 2
                              : shape.points.size() > 1                               ? 1
                                                                                      : 0;
  if (from.sigma_m > kLostJoint_m[telling]) {
    growth.bone.world_from_bone = {from.place_m - from.rest * from.joint_m, from.rest};
    growth.bone.point_of.resize(shape.points.size());
    std::fill(growth.bone.point_of.begin(), growth.bone.point_of.end(), -1);
    if (growths_.size() < kMostGrowths) growths_.push_back(growth);
    return;
  }
  for (const pose::LaidBone& laid : layer_.lay(shape, from, *cloud_, reading.taken, reading.point_of_marker)) {
    const double beyond = beyond_range(reading, next, laid);
    if (beyond > kMostBeyond || growths_.size() == kMostGrowths) continue;
    growth.bone = laid;
    growth.cost = reading.cost + laid.cost + beyond;
    growths_.push_back(growth);
  }
}

// Whether two readings have the same bones where more is to be hung.
bool BodyLayer::alike(const BodyReading& a, const BodyReading& b) const {
  for (std::size_t i = turn_ + 1; i < plan_->size(); ++i) {
    const auto from = static_cast<std::size_t>((*plan_)[i].from);
    const bool later = std::any_of(plan_->begin() + static_cast<std::ptrdiff_t>(turn_) + 1,
                                   plan_->begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const NextBone& next) { return next.bone == static_cast<int>(from); });
    if (later) continue;
    for (const kinematics::ShapePoint& point : shapes_.of(from).points) {
      const auto m = static_cast<std::size_t>(point.marker);
      if (a.point_of_marker[m] != b.point_of_marker[m]) return false;
    }
  }
  return true;
}

void BodyLayer::take_best() {
  std::sort(growths_.begin(), growths_.end(), [](const Growth& a, const Growth& b) {
    return a.cost != b.cost ? a.cost < b.cost : a.reading < b.reading;
  });
  readings_.swap(before_);
  count_ = 0;
  const NextBone& next = (*plan_)[turn_];
  const bool last = turn_ + 1 == plan_->size();
  for (const Growth& growth : growths_) {
    if (count_ == kMostReadings || growth.cost > growths_.front().cost + kMostBehind) break;
    BodyReading& into = readings_[count_];
    into = before_[growth.reading];
    adopt(into, growth, next.bone, next.here_m);
    std::size_t same = 0;
    for (std::size_t i = 0; i < count_ && same < kMostAlike; ++i) {
      if (readings_[i].point_of_marker == into.point_of_marker) same = kMostAlike;
      if (!last && alike(readings_[i], into)) ++same;
    }
    if (same < kMostAlike) ++count_;
  }
  growths_.clear();
  next_ = 0;
  ++turn_;
}

}  // namespace mocap::identify
