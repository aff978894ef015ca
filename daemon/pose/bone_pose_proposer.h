#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "geometry/rigid_fit.h"
#include "kinematics/bone_shapes.h"
#include "model/transform.h"
#include "pose/point_cloud.h"

namespace mocap::pose {

struct BoneProposalSettings {
  double marker_sigma_m = 0.006;      ///< of a marker from its position on the bone
  double missed_fraction = 0.1;       ///< prior probability that a marker is not detected
  double clutter_density_1_m3 = 1.0;  ///< density of points that do not belong to this body

  void archive(Archive& members) { members(marker_sigma_m, missed_fraction, clutter_density_1_m3); }
};

/// Rotational degrees of freedom of a bone that its points observe.
enum class Dof {
  None,   ///< none: the bone has the rotation of a rigid joint
  Swing,  ///< one point beside the joint: the twist about the line through both is unobserved
  Full,   ///< all
};

/// A proposed pose of a bone, with the points assigned to its markers.
struct BoneProposal {
  Pose world_from_bone;
  Dof dof = Dof::None;
  /// axis of the unobserved twist through the joint, in the bone's frame
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  double cost = 0.0;  ///< minus the log likelihood ratio to no detection of the bone
  int seen = 0;
  /// by point of the shape; -1: not detected; -2: the marker has a point of a neighbour
  BoundedVector<int, kinematics::kMaxShapePoints> point_of;

  void archive(Archive& members) { members(world_from_bone, dof, axis, cost, seen, point_of); }
};

/// The joint that a bone is attached to.
struct JointAnchor {
  Eigen::Vector3d joint_m = Eigen::Vector3d::Zero();         ///< in the bone's frame
  Eigen::Vector3d anchor_m = Eigen::Vector3d::Zero();        ///< in the world frame
  double sigma_m = 0.01;                                     ///< of `anchor_m`
  Eigen::Quaterniond rest = Eigen::Quaterniond::Identity();  ///< rotation of the bone if the joint were rigid
};

/// Proposes poses of one bone for a set of unlabelled points: all poses whose likelihood is near the best. The bone is
/// either free (three points of its shape determine the pose) or attached to a joint of known position (distances to
/// the joint select the points).
///
/// The cost is minus a log likelihood ratio: each assigned point contributes half its squared normalised residual and
/// the log odds that a clutter point lies in the same volume. The interpretation of points by distances between them
/// follows Grimson and Lozano-Perez, Localizing overlapping parts by searching the interpretation tree (1987).
///
/// Allocates in the constructor only.
class BonePoseProposer {
 public:
  BonePoseProposer();

  void set(const BoneProposalSettings& settings) { settings_ = settings; }

  /// Proposes poses of a free bone in which the point `first` is one of three points that determine the pose. To be
  /// called for each `first`. Adds to `into`, which keeps the best `max_count` proposals.
  void propose_from_points(const kinematics::BoneShape& shape, const PointCloud& cloud, std::size_t first,
                           std::size_t max_count, std::vector<BoneProposal>& into);

  /// Proposes poses of a bone attached to a joint. Markers with a point (`point_of_marker` >= 0) are not searched. The
  /// result is valid until the next call; its last element is the pose without any detection.
  std::span<const BoneProposal> propose_from_joint(const kinematics::BoneShape& shape, const JointAnchor& from,
                                                   const PointCloud& cloud, const UsedPoints& used,
                                                   std::span<const int> point_of_marker);

  /// Rigid fits and distance searches since the construction, to bound the work.
  std::size_t work() const noexcept { return work_; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(settings_, bone_, work_); }

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
  BoneProposal bone_;  // the proposal under construction
  std::vector<BoneProposal> proposals_;
  std::vector<geometry::PointPair> pairs_;
  // by point of the shape: indices of the points at the right distance from the joint
  std::vector<std::vector<int>> shells_;
  std::size_t work_ = 0;
};

}  // namespace mocap::pose
