#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "base/archive.h"

namespace mocap::pose {

/// Running mean of each joint's rotation over the last second. It is the mean reversion target of a joint that no
/// marker observes, as in an Ornstein-Uhlenbeck process: over half a second a hidden limb is nearer to its mean
/// rotation than to its last observed one (decision 0012).
///
/// Allocates in the constructor only.
class RunningMeanRotation {
 public:
  explicit RunningMeanRotation(std::size_t bones) : bones_(bones) {}

  /// Forgets all means.
  void reset();
  /// Adds an observation: the joint had the rotation `local` for `step_s`; `observed_fraction` is the part that markers
  /// observed (parent's frame; 1 along an axis that markers alone determine).
  void update(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& observed_fraction,
              double step_s);

  bool known(std::size_t bone) const { return bones_[bone].observed_s > 0.0; }
  /// The rotation from `local` to the mean as a rotation vector in the parent's frame, rad; 0 if no mean is known.
  Eigen::Vector3d rotation_to_mean(std::size_t bone, const Eigen::Quaterniond& local) const;

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(bones_); }

 private:
  struct Mean {
    Eigen::Quaterniond local = Eigen::Quaterniond::Identity();
    double observed_s = 0.0;  // time in the mean, at most kMeanWindow_s

    void archive(Archive& members) { members(local, observed_s); }
  };
  std::vector<Mean> bones_;
};

/// Standard deviation of a joint rotation around its running mean, about any axis. Chosen by hand; not yet measured.
inline constexpr double kMeanReversionSigma_rad = 0.4;

}  // namespace mocap::pose
