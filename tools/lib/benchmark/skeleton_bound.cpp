#include "lib/benchmark/skeleton_bound.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "kinematics/algebra.h"
#include "kinematics/rotation.h"
#include "scene/random.h"

namespace mocap::benchmark {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kEachFrame = 10;
constexpr int kSamples = 10;
constexpr double kJointPrior_rad = 35.0 * std::numbers::pi / 180.0 / std::numbers::sqrt3;  // each axis
constexpr double kMinSigma_m = 1e-6;  // without soft tissue the information would be infinite

// The pose of a body in one frame and its derivatives by the position of the root and by small rotations of the joints,
// in the world frame.
class PoseDerivatives {
 public:
  PoseDerivatives(const Skeleton& skeleton, const Pose* world) : skeleton_(skeleton), world_(world) {}

  Eigen::Index size() const { return 3 + 3 * static_cast<Eigen::Index>(skeleton_.bones.size()); }

  // Of a point that is attached to a bone, 3 x size().
  MatrixXd of_point(int bone, const Eigen::Vector3d& at_m) const {
    MatrixXd derivative = MatrixXd::Zero(3, size());
    derivative.leftCols<3>().setIdentity();
    for (int b = bone; b >= 0; b = parent(b))
      derivative.middleCols<3>(column(b)) = -kinematics::cross_matrix(at_m - world_[b].position);
    return derivative;
  }
  // The small rotation of a bone in the world frame.
  Eigen::Vector3d rotation_of(int bone, const VectorXd& change) const {
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
    for (int b = bone; b >= 0; b = parent(b)) rotation += change.segment<3>(column(b));
    return rotation;
  }

 private:
  static Eigen::Index column(int bone) { return 3 + 3 * static_cast<Eigen::Index>(bone); }
  int parent(int bone) const { return skeleton_.bones[static_cast<std::size_t>(bone)].parent; }

  const Skeleton& skeleton_;
  const Pose* world_;
};

std::vector<bool> seen_markers(const NoisyFrame& frame, std::size_t markers) {
  std::vector<bool> seen(markers);
  for (const NoisyPoint& point : frame.points) {
    if (point.marker != NoisyPoint::kNobodys) seen[static_cast<std::size_t>(point.marker)] = true;
  }
  return seen;
}

// Fisher information of the pose by the markers that are seen, plus that of the prior. The errors of the n markers of a
// bone have the covariance s^2 (I + 1 1^T) in each axis, the inverse of which is (I - 1 1^T / (1 + n)) / s^2.
MatrixXd information_of(const MarkerSet& body, const Pose* world, const PoseDerivatives& pose,
                        const std::vector<bool>& seen, double sigma_m) {
  MatrixXd information = MatrixXd::Zero(pose.size(), pose.size());
  for (int bone = 0; bone < static_cast<int>(body.skeleton.bones.size()); ++bone) {
    MatrixXd sum = MatrixXd::Zero(3, pose.size());
    int count = 0;
    for (std::size_t m = 0; m < body.markers.size(); ++m) {
      if (body.markers[m].bone != bone || !seen[m]) continue;
      const MatrixXd derivative = pose.of_point(bone, world[bone] * body.markers[m].offset_m);
      information.noalias() += derivative.transpose() * derivative;
      sum += derivative;
      ++count;
    }
    information.noalias() -= sum.transpose() * sum / (1.0 + count);
  }
  information /= sigma_m * sigma_m;
  information.diagonal().tail(pose.size() - 6).array() += 1.0 / (kJointPrior_rad * kJointPrior_rad);
  return information;
}

// The true pose with a small error.
SubjectPose displaced(const Skeleton& skeleton, const Pose* world, const PoseDerivatives& pose,
                      const VectorXd& change) {
  SubjectPose result;
  for (int b = 0; b < static_cast<int>(skeleton.bones.size()); ++b) {
    BonePose bone;
    bone.state = BoneState::Measured;
    bone.world_from_bone.position = world[b].position + pose.of_point(b, world[b].position) * change;
    bone.world_from_bone.rotation = kinematics::from_rotation_vector(pose.rotation_of(b, change)) * world[b].rotation;
    result.bones.push_back(bone);
  }
  return result;
}

}  // namespace

SkeletonFigures skeleton_bound(const PosedClip& clip, const PointNoise& noise, std::uint64_t seed) {
  const std::vector<NoisyFrame> frames = add_noise(clip.clip, noise, seed);
  const double sigma_m = std::max(kMinSigma_m, soft_tissue_sigma_m(clip.soft_tissue_mm));
  const Skeleton& skeleton = clip.body.skeleton;
  SkeletonErrors errors(skeleton);
  scene::Random random(scene::mixed(seed));
  std::uint64_t samples = 0;
  for (std::size_t i = clip.begin; i < frames.size(); i += kEachFrame) {
    const PoseDerivatives pose(skeleton, clip.bones(i));
    const std::vector<bool> seen = seen_markers(frames[i], clip.body.markers.size());
    const Eigen::LLT<MatrixXd> root(information_of(clip.body, clip.bones(i), pose, seen, sigma_m));
    if (root.info() != Eigen::Success) continue;
    for (int sample = 0; sample < kSamples; ++sample, ++samples) {
      const VectorXd normal = VectorXd::NullaryExpr(pose.size(), [&] { return random.normal(); });
      errors.add(displaced(skeleton, clip.bones(i), pose, root.matrixU().solve(normal)), clip.bones(i));
    }
  }
  return errors.figures(samples);
}

}  // namespace mocap::benchmark
