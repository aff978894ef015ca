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
struct BodyUncertainty {
  double marker_sigma_m = 0.003;  ///< of a marker from where the fitted body puts it
  double joint_sigma_m = 0.010;   ///< of a joint between two bones, as the fit has it
};

/// Some bones of a body laid on some points.
struct BodyPoseHypothesis {
  double cost = 0.0;  ///< minus log of how much likelier than that nothing of the body is seen
  pose::UsedPoints used;
  std::vector<int> point_of_marker;             ///< -1: none
  std::vector<pose::BonePoseHypothesis> bones;  ///< those not laid yet mean nothing
};

/// A bone to be laid next, and how it hangs on one that is laid.
struct SearchStep {
  int bone = 0;
  int from = 0;
  Eigen::Vector3d joint_in_bone_m = Eigen::Vector3d::Zero();       ///< the joint in its own frame
  Eigen::Vector3d joint_in_neighbour_m = Eigen::Vector3d::Zero();  ///< the same in the other's
};

/// All bones by limbs, so that each hangs on one before it.
using SearchPlan = std::vector<SearchStep>;

/// Lays a body on points bone by bone and follows many readings at once, the likeliest.
///
/// Readings that differ only in limbs which are done already are alike for all that follows: few of each are kept, so
/// that doubts about one limb do not crowd out those about another. Allocates in the constructor only.
class BodyPoseSearch {
 public:
  explicit BodyPoseSearch(const MarkerSet& set);

  /// `set` is the one of the constructor but for its offsets.
  void refit(const MarkerSet& set);

  const kinematics::BoneShapes& shapes() const noexcept { return shapes_; }
  /// How the tree is laid from `root` on; and one with the offsets after a refit. For constructors, and for refits.
  SearchPlan plan_from(int root) const;
  void refit(SearchPlan& plan) const;

  /// Begins anew; `cloud` outlives the search.
  void begin(const pose::PointCloud& cloud, const BodyUncertainty& uncertainty, double clutter_density_1_m3);

  /// Bone `root` wherever it may be, then the plan. Both outlive the growth.
  void start(int root, const SearchPlan& plan);
  /// The bones of the plan on what is left by a reading that has laid the others. The plan outlives the growth.
  void start(const BodyPoseHypothesis& hypothesis, const SearchPlan& plan);
  /// A bit more; true when the plan is done.
  bool expand();
  /// The likeliest first.
  std::span<const BodyPoseHypothesis> hypotheses() const { return std::span(hypotheses_).first(count_); }

  /// Bone fits since it was made.
  std::size_t work() const noexcept { return proposer_.work(); }

 private:
  struct Expansion {
    double cost = 0.0;
    std::size_t hypothesis = 0;
    double joint_sigma_m = 0.0;
    pose::BoneProposal bone;
  };

  bool seed_root();
  void expand(std::size_t hypothesis);
  pose::JointAnchor make_anchor(const BodyPoseHypothesis& hypothesis, const SearchStep& next) const;
  double range_cost(const BodyPoseHypothesis& hypothesis, const SearchStep& next,
                    const pose::BoneProposal& proposal) const;
  void prune_beam();
  void apply_expansion(BodyPoseHypothesis& into, const Expansion& expansion, int bone,
                       const Eigen::Vector3d& joint_m) const;
  bool are_equivalent(const BodyPoseHypothesis& a, const BodyPoseHypothesis& b) const;

  MarkerSet set_;
  kinematics::BoneShapes shapes_;
  pose::BonePoseProposer proposer_;
  BodyUncertainty uncertainty_;
  const pose::PointCloud* cloud_ = nullptr;
  const SearchPlan* plan_ = nullptr;
  int root_ = -1;  // while it is looked for
  std::size_t next_ = 0, step_ = 0;
  std::vector<pose::BoneProposal> seeds_;
  std::vector<BodyPoseHypothesis> hypotheses_, previous_hypotheses_;
  std::size_t count_ = 0;
  std::vector<Expansion> expansions_;
};

}  // namespace mocap::identify
