#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "base/bounded_vector.h"
#include "geometry/rigid_fit.h"
#include "kinematics/bone_shapes.h"
#include "model/transform.h"
#include "pose/point_cloud.h"

namespace mocap::pose {

struct BoneProposalSettings {
  double marker_sigma_m = 0.006;      ///< of a marker from its place on its bone
  double missed_fraction = 0.1;       ///< of the markers, to reckon with
  double clutter_density_1_m3 = 1.0;  ///< points that are not this body's, to reckon with
};

/// How well the turn of a bone is told.
enum class Dof {
  None,   ///< by no point: it is as if its joint were stiff
  Swing,  ///< by one point beside its joint: the turn about the line through both is open
  Full,   ///< in full
};

/// A bone as some points tell it.
struct BoneProposal {
  Pose world_from_bone;
  Dof dof = Dof::None;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();  ///< of what is open, in the bone's frame, through its joint
  double cost = 0.0;                               ///< minus log of how much likelier than that nothing of it is seen
  int seen = 0;
  BoundedVector<int, kinematics::kMaxShapePoints> point_of;  ///< by point of the shape; -1: not seen
};

/// Where a bone hangs.
struct JointAnchor {
  Eigen::Vector3d joint_m = Eigen::Vector3d::Zero();         ///< in the bone's frame
  Eigen::Vector3d anchor_m = Eigen::Vector3d::Zero();        ///< in the world
  double sigma_m = 0.01;                                     ///< of that place
  Eigen::Quaterniond rest = Eigen::Quaterniond::Identity();  ///< the bone's turn if the joint were stiff
};

/// Lays one bone on the points that may be its markers, in all ways that are about as likely as the best: from nothing
/// by three points of its shape, or from a joint by the distances to it.
///
/// How likely: each point that fits is weighed by how well, against how many points would be as near by chance.
/// Allocates in the constructor only.
class BonePoseProposer {
 public:
  BonePoseProposer();

  void set(const BoneProposalSettings& settings) { settings_ = settings; }

  /// From nothing, begun by the point `first` alone, to be called for each; appends the readings to `into`, of which
  /// the best `max_count` are kept.
  void propose_from_points(const kinematics::BoneShape& shape, const PointCloud& cloud, std::size_t first,
                           std::size_t max_count, std::vector<BoneProposal>& into);

  /// From a joint. Markers that already have a point (`point_of_marker`) are not looked for. Borrowed until the next
  /// call; the last is that nothing of the bone is seen.
  std::span<const BoneProposal> propose_from_joint(const kinematics::BoneShape& shape, const JointAnchor& from,
                                                   const PointCloud& cloud, const UsedPoints& used,
                                                   std::span<const int> point_of_marker);

  /// Fits and looks since the start, for a bound on work.
  std::size_t work() const noexcept { return work_; }

 private:
  void complete_proposal(const kinematics::BoneShape& shape, const JointAnchor* from, const PointCloud& cloud,
                         const UsedPoints& used);
  void propose_swing(const kinematics::BoneShape& shape, const JointAnchor& from, const PointCloud& cloud,
                     std::size_t at, std::size_t point);
  bool fit(const kinematics::BoneShape& shape, const JointAnchor* from, const PointCloud& cloud);
  void score(const kinematics::BoneShape& shape, const JointAnchor* from, const PointCloud& cloud);
  bool is_proposed(std::size_t a, int p, std::size_t b, int q, std::span<const BoneProposal> among) const;
  void keep_best(std::vector<BoneProposal>& into, std::size_t max_count) const;
  double clutter_log_odds(double volume_m3) const;

  BoneProposalSettings settings_;
  BoneProposal bone_;  // that is being made
  std::vector<BoneProposal> proposals_;
  std::vector<geometry::PointPair> pairs_;
  std::vector<std::vector<int>> shells_;  // by point of the shape: the points that are as far from the joint
  std::size_t work_ = 0;
};

}  // namespace mocap::pose
