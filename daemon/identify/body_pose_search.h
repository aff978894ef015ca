#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "base/archive.h"
#include "kinematics/bone_shapes.h"
#include "model/skeleton.h"
#include "model/transform.h"
#include "pose/bone_pose_hypothesis.h"
#include "pose/bone_pose_proposer.h"
#include "pose/point_cloud.h"

namespace mocap::identify {

/// Standard deviations of the dimensions of a fitted body.
struct BodyUncertainty {
  double marker_sigma_m = 0.003;  ///< of a marker from its position on the fitted body
  double joint_sigma_m = 0.010;   ///< of the joint between two bones

  void archive(Archive& members) { members(marker_sigma_m, joint_sigma_m); }
};

/// A partial pose of a body with the points assigned to its markers.
struct BodyPoseHypothesis {
  double cost = 0.0;  ///< minus the log likelihood ratio to no detection of the body
  pose::UsedPoints used;
  std::vector<int> point_of_marker;             ///< -1: none
  std::vector<pose::BonePoseHypothesis> bones;  ///< undefined for bones that the search has not reached

  void archive(Archive& members) { members(cost, used, point_of_marker, bones); }
};

/// One step of a search: a bone, and the joint to a neighbour that already has a pose.
struct SearchStep {
  int bone = 0;
  int from = 0;                                                    ///< the neighbour
  Eigen::Vector3d joint_in_bone_m = Eigen::Vector3d::Zero();       ///< the joint in the frame of `bone`
  Eigen::Vector3d joint_in_neighbour_m = Eigen::Vector3d::Zero();  ///< the joint in the frame of `from`
};

/// The order of a search, limb by limb: `from` of each step is the start or the bone of an earlier step.
using SearchPlan = std::vector<SearchStep>;

/// Beam search for the pose of a body: places one bone after the other on points and keeps the hypotheses of least
/// cost.
///
/// Hypotheses that differ only in completed limbs have the same continuations. The search keeps few of these, so that
/// the ambiguities of one limb do not displace those of another limb. Allocates in the constructor only.
class BodyPoseSearch {
 public:
  explicit BodyPoseSearch(const MarkerSet& set);

  /// Takes over fitted offsets. `set` equals the set of the constructor except for its offsets.
  void refit(const MarkerSet& set);

  const kinematics::BoneShapes& shapes() const noexcept { return shapes_; }
  /// The order of a search that starts at `root`; the limbs of each bone in the order of the skeleton or, if
  /// `last_first`, in the opposite one. Allocates.
  SearchPlan plan_from(int root, bool last_first = false) const;
  /// Updates the joints of a plan after a refit. Allocates nothing.
  void refit(SearchPlan& plan) const;

  /// Sets the points and the uncertainty of the next searches. `cloud` outlives these searches.
  void begin(const pose::PointCloud& cloud, const BodyUncertainty& uncertainty, double clutter_density_1_m3);

  /// Starts a search for the bone `root` at any position, then for the bones of `plan`. The plan outlives the search.
  void start(int root, const SearchPlan& plan);
  /// Starts a search for the bones of `plan` on the points that `hypothesis` does not use; all other bones of the
  /// hypothesis have a pose. The plan outlives the search.
  void start(const BodyPoseHypothesis& hypothesis, const SearchPlan& plan);
  /// The points of the search in progress have moved to this object, which must outlive the search.
  void follow(const pose::PointCloud& cloud) noexcept { cloud_ = &cloud; }
  /// Does one step: proposes the first bone from one point, or extends one hypothesis by one bone. Returns true when
  /// the plan is complete or no hypothesis is left.
  bool expand();
  /// The hypotheses, by ascending cost.
  std::span<const BodyPoseHypothesis> hypotheses() const { return std::span(hypotheses_).first(count_); }

  /// Bone fits and distance searches since the construction.
  std::size_t work() const noexcept { return proposer_.work(); }

  /// Writes the search in progress, or takes it over (see Archive). A reader first calls `refit`, `begin` and `start`
  /// with the offsets, the points and the plan of that search, which are not among the members.
  void archive(Archive& members);

 private:
  struct Expansion {
    double cost = 0.0;
    std::size_t hypothesis = 0;
    double joint_sigma_m = 0.0;
    pose::BoneProposal bone;

    void archive(Archive& members) { members(cost, hypothesis, joint_sigma_m, bone); }
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
  bool fits(const pose::BoneProposal& proposal, int bone) const;
  bool has_valid_indices() const;

  MarkerSet set_;
  kinematics::BoneShapes shapes_;
  pose::BonePoseProposer proposer_;
  BodyUncertainty uncertainty_;
  const pose::PointCloud* cloud_ = nullptr;
  const SearchPlan* plan_ = nullptr;
  int root_ = -1;  // first bone, until its proposals are complete; then -1
  std::size_t next_ = 0, step_ = 0;
  std::vector<pose::BoneProposal> seeds_;
  std::vector<BodyPoseHypothesis> hypotheses_, previous_hypotheses_;
  std::size_t count_ = 0;
  std::vector<Expansion> expansions_;
};

}  // namespace mocap::identify
