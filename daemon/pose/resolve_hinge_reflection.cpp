// The part of SkeletonTracker that bends a knee or an elbow back which went through straight to the wrong side.

#include <algorithm>
#include <cmath>

#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// A joint that bends one way only: its range on the other side is at most this share.
constexpr double kMaxReverseRangeFraction = 0.15;
// So far beyond its range it did not stretch, it went on to the wrong side, rad.
constexpr double kHingeLimitTolerance_rad = 0.05;
// In half squared sigmas: what explains the markers about as well.
constexpr double kEquivalentCost = 0.5;
// Of three joints in a line there are no sides.
constexpr double kMinCollinearOffset_m = 0.005;

bool violates_hinge_limit(const Bone& bone, const Eigen::Quaterniond& local) {
  Eigen::Vector3d turned;
  bool known = false;
  for (int axis = 0; axis < 3; ++axis) {
    const auto& range = bone.turns[static_cast<std::size_t>(axis)];
    if (!range) continue;
    const double up = std::max(0.0, range->max_rad), down = std::max(0.0, -range->min_rad);
    if (std::min(up, down) > kMaxReverseRangeFraction * std::max(up, down)) continue;
    if (!known) turned = kinematics::rotation_vector(local);
    known = true;
    const double wrongly = up > down ? range->min_rad - turned[axis] : turned[axis] - range->max_rad;
    if (wrongly > kHingeLimitTolerance_rad) return true;
  }
  return false;
}

}  // namespace

// Where a limb is stretched, its ends alone do not tell to which side its middle joint bends next, and motion may lead
// it beyond its range. Both sides explain the ends alike; that which the joint can bend to is taken.
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

// The joint of `lower` goes to the other side of the line from the joint above to the one below; what hangs on stays.
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
  const Eigen::Vector3d out = world[lower].position - world[upper].position;
  const Eigen::Vector3d aside = out - out.dot(line) * line;
  if (!(aside.norm() > kMinCollinearOffset_m)) return false;
  const Eigen::Quaterniond swung = kinematics::rotation_between(out, out - 2.0 * aside);
  const Eigen::Vector3d on = world[end].position - world[lower].position;
  const Eigen::Quaterniond bent = kinematics::rotation_between(swung * on, on + 2.0 * aside);
  const Eigen::Quaterniond upper_turn = swung * world[upper].rotation;
  const Eigen::Quaterniond lower_turn = bent * swung * world[lower].rotation;
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  trial_pose_[upper].rotation = (world[root].rotation.conjugate() * upper_turn).normalized();
  trial_pose_[lower].rotation = (upper_turn.conjugate() * lower_turn).normalized();
  for (std::size_t b = 0; b < bones.size(); ++b) {
    if (bones[b].parent == static_cast<int>(lower))
      trial_pose_[b].rotation = (lower_turn.conjugate() * world[b].rotation).normalized();
  }
  pose_.set_locals(trial_pose_);
  return true;
}

}  // namespace mocap::pose
