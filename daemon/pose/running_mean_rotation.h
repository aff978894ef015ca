#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace mocap::pose {

/// How each joint was turned in the last second, in the mean. A limb that nobody sees does not go on for long, nor does
/// it stop: over half a second it is nearer to the middle of what it did than to where it was last seen.
///
/// Allocates in the constructor only.
class RunningMeanRotation {
 public:
  explicit RunningMeanRotation(std::size_t bones) : bones_(bones) {}

  /// Nothing is known of any joint.
  void reset();
  /// A joint was turned so for `step_s`, of which markers told `observed_fraction` (1 along an axis that they told
  /// alone, in the parent's frame).
  void update(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& observed_fraction,
              double step_s);

  bool known(std::size_t bone) const { return bones_[bone].observed_s > 0.0; }
  /// What turns `local` to how the joint is usually: a rotation vector in the parent's frame, rad; 0 where that is not
  /// known.
  Eigen::Vector3d rotation_to_mean(std::size_t bone, const Eigen::Quaterniond& local) const;

 private:
  struct Mean {
    Eigen::Quaterniond local = Eigen::Quaterniond::Identity();
    double observed_s = 0.0;  // at most what the mean is over
  };
  std::vector<Mean> bones_;
};

/// How far a joint commonly is from its usual turn, about any axis, rad.
inline constexpr double kMeanReversionSigma_rad = 0.4;

}  // namespace mocap::pose
