// SkeletonTracker, continued: the reflection ambiguity of an elbow or knee.

#include <algorithm>
#include <cmath>

#include "kinematics/hinge_range.h"
#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// Beyond its range by more than this, a joint is not just stretched, it bends to the wrong side. Chosen by hand; not
// yet measured.
constexpr double kHingeLimitTolerance_rad = 0.05;
// Two fits explain the markers equally well if their costs differ by less, in half squared standard deviations. Chosen
// by hand; not yet measured.
constexpr double kEquivalentCost = 0.5;
// The reflection is undefined if the joint is nearer to the line between its neighbours. Chosen by hand; not yet
// measured.
constexpr double kMinCollinearOffset_m = 0.005;

bool violates_hinge_limit(const Bone& bone, const Eigen::Quaterniond& local) {
  Eigen::Vector3d rotation_rad;
  bool known = false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& range = bone.rotation_limits[static_cast<std::size_t>(axis)];
    if (!range) continue;
    const kinematics::AxisReach reach = kinematics::reach_of(*range);
    if (!kinematics::bends_one_way(reach)) continue;
    if (!known) rotation_rad = kinematics::rotation_vector(local);
    known = true;
    const double excess_rad = reach.positive_rad > reach.negative_rad ? range->min_rad - rotation_rad[axis]
                                                                      : rotation_rad[axis] - range->max_rad;
    if (excess_rad > kHingeLimitTolerance_rad) return true;
  }
  return false;
}

}  // namespace

// Reflects each hinge that violates its range and is observed by no own marker. The ends of a stretched limb do not
// determine to which side the middle joint bends next, and the motion model may lead it to the wrong side. Both sides
// explain the ends equally well; the side within the range is accepted (decision 0005).
kinematics::PoseFitResult SkeletonTracker::resolve_hinge_reflection(std::span<const kinematics::Observation> seen,
                                                                    const kinematics::PosePrior& prior,
                                                                    const kinematics::PoseFitEnd& end,
                                                                    kinematics::PoseFitResult first) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  for (std::size_t lower = 0; lower < bones.size(); ++lower) {
    const int upper = bones[lower].parent;
    if (upper < 0 || bones[static_cast<std::size_t>(upper)].parent < 0) continue;
    const auto above = static_cast<std::size_t>(upper);
    if (bones_[lower].observability == Observability::Full || bones_[above].observability == Observability::Full)
      continue;
    if (!violates_hinge_limit(bones[lower], pose_.locals()[lower].rotation)) continue;
    std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
    if (!reflect_hinge(lower)) continue;
    const kinematics::PoseFitResult second = pose_.solve(seen, prior, end);
    if (second.cost < first.cost + kEquivalentCost &&
        !violates_hinge_limit(bones[lower], pose_.locals()[lower].rotation)) {
      first = second;
      reinitialised_[lower] = reinitialised_[above] = 1;
    } else {
      pose_.set_locals(fallback_pose_);
    }
  }
  return first;
}

// Reflects the joint of `lower` at the line from the joint above to the joint below. The descendants keep their world
// rotations.
bool SkeletonTracker::reflect_hinge(std::size_t lower) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  const auto upper = static_cast<std::size_t>(bones[lower].parent);
  const auto root = static_cast<std::size_t>(bones[upper].parent);
  const auto below = std::find_if(bones.begin(), bones.end(),
                                  [&](const Bone& bone) { return bone.parent == static_cast<int>(lower); });
  if (below == bones.end()) return false;
  const auto end = static_cast<std::size_t>(below - bones.begin());
  const std::span<const Pose> world = pose_.world();
  const Eigen::Vector3d line = (world[end].position - world[upper].position).normalized();
  const Eigen::Vector3d upper_axis = world[lower].position - world[upper].position;
  const Eigen::Vector3d offset = upper_axis - upper_axis.dot(line) * line;
  if (!(offset.norm() > kMinCollinearOffset_m)) return false;
  const Eigen::Quaterniond upper_swing = kinematics::rotation_between(upper_axis, upper_axis - 2.0 * offset);
  const Eigen::Vector3d lower_axis = world[end].position - world[lower].position;
  const Eigen::Quaterniond lower_swing =
      kinematics::rotation_between(upper_swing * lower_axis, lower_axis + 2.0 * offset);
  const Eigen::Quaterniond upper_rotation = upper_swing * world[upper].rotation;
  const Eigen::Quaterniond lower_rotation = lower_swing * upper_swing * world[lower].rotation;
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  trial_pose_[upper].rotation = (world[root].rotation.conjugate() * upper_rotation).normalized();
  trial_pose_[lower].rotation = (upper_rotation.conjugate() * lower_rotation).normalized();
  for (std::size_t b = 0; b < bones.size(); ++b) {
    if (bones[b].parent == static_cast<int>(lower))
      trial_pose_[b].rotation = (lower_rotation.conjugate() * world[b].rotation).normalized();
  }
  pose_.set_locals(trial_pose_);
  return true;
}

}  // namespace mocap::pose
