#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "kinematics/bone_shapes.h"
#include "model/skeleton.h"
#include "model/transform.h"
#include "pose/bone_pose_hypothesis.h"
#include "pose/bone_pose_proposer.h"
#include "pose/point_cloud.h"

namespace mocap::identify {

/// How well a body's measures are known.
struct BodyKnown {
  double marker_sigma_m = 0.003;  ///< of a marker from where the fitted body puts it
  double joint_sigma_m = 0.010;   ///< of a joint between two bones, as the fit has it
};

/// Some bones of a body laid on some points.
struct BodyReading {
  double cost = 0.0;  ///< minus log of how much likelier than that nothing of the body is seen
  pose::PointsTaken taken;
  std::vector<int> point_of_marker;  ///< -1: none
  std::vector<pose::BoneReading> bones;    ///< those not laid yet mean nothing
};

/// A bone to be laid next, and how it hangs on one that is laid.
struct NextBone {
  int bone = 0;
  int from = 0;
  Eigen::Vector3d here_m = Eigen::Vector3d::Zero();   ///< the joint in its own frame
  Eigen::Vector3d there_m = Eigen::Vector3d::Zero();  ///< the same in the other's
};

/// All bones by limbs, so that each hangs on one before it.
using LayPlan = std::vector<NextBone>;

/// Lays a body on points bone by bone and follows many readings at once, the likeliest.
///
/// Readings that differ only in limbs which are done already are alike for all that follows: few of each are kept, so
/// that doubts about one limb do not crowd out those about another. Allocates in the constructor only.
class BodyLayer {
 public:
  explicit BodyLayer(const MarkerSet& set);

  /// `set` is the one of the constructor but for its offsets.
  void refit(const MarkerSet& set);

  const kinematics::BoneShapes& shapes() const noexcept { return shapes_; }
  /// How the tree is laid from `root` on; and one with the offsets after a refit. For constructors, and for refits.
  LayPlan plan_from(int root) const;
  void refit(LayPlan& plan) const;

  /// Begins anew; `cloud` outlives the search.
  void begin(const pose::BodyCloud& cloud, const BodyKnown& known, double strays_1_m3);

  /// Bone `root` wherever it may be, then the plan. Both outlive the growth.
  void start(int root, const LayPlan& plan);
  /// The bones of the plan on what is left by a reading that has laid the others. The plan outlives the growth.
  void start(const BodyReading& reading, const LayPlan& plan);
  /// A bit more; true when the plan is done.
  bool grow();
  /// The likeliest first.
  std::span<const BodyReading> readings() const { return std::span(readings_).first(count_); }

  /// Bone fits since it was made.
  std::size_t work() const noexcept { return layer_.work(); }

 private:
  struct Growth {
    double cost = 0.0;
    std::size_t reading = 0;
    double joint_sigma_m = 0.0;
    pose::LaidBone bone;
  };

  bool seed();
  void grow(std::size_t reading);
  pose::LayFrom hang(const BodyReading& reading, const NextBone& next) const;
  double beyond_range(const BodyReading& reading, const NextBone& next, const pose::LaidBone& laid) const;
  void take_best();
  void adopt(BodyReading& into, const Growth& growth, int bone, const Eigen::Vector3d& joint_m) const;
  bool alike(const BodyReading& a, const BodyReading& b) const;

  MarkerSet set_;
  kinematics::BoneShapes shapes_;
  pose::BoneLayer layer_;
  BodyKnown known_;
  const pose::BodyCloud* cloud_ = nullptr;
  const LayPlan* plan_ = nullptr;
  int root_ = -1;  // while it is looked for
  std::size_t next_ = 0, turn_ = 0;
  std::vector<pose::LaidBone> seeds_;
  std::vector<BodyReading> readings_, before_;
  std::size_t count_ = 0;
  std::vector<Growth> growths_;
};

}  // namespace mocap::identify
