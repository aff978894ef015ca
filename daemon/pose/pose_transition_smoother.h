#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "model/transform.h"

namespace mocap::pose {

/// Lets a pose that jumps because other markers tell it now glide to where it should be: a marker that comes back after
/// a while shows that a limb is elsewhere than thought. What jumps is the difference to where the motion led to; it
/// fades away as a critically damped spring does, so that neither place nor speed jumps, to a tenth within 0.16 s.
/// Motion that led farther astray than what was shown last is not followed: then it is that which fades, from rest.
/// Where the same markers tell the pose, nothing is changed, however it moves.
///
/// Allocates in the constructor only.
class PoseEaser {
 public:
  explicit PoseEaser(std::size_t bones);

  /// Nothing fades any more.
  void reset();

  /// One instant, `step_s` after the last: `poses` are the local poses that were found, `foreseen` those that the
  /// motion led to, and `changed` says of each bone whether other markers tell it than before. Gives what is to be
  /// shown.
  std::span<const Pose> step(std::span<const Pose> poses, std::span<const Pose> foreseen,
                             std::span<const std::uint8_t> changed, double step_s);

 private:
  struct Fading {
    Eigen::Vector3d left = Eigen::Vector3d::Zero();
    Eigen::Vector3d rate_1_s = Eigen::Vector3d::Zero();
    double usual2 = 0.0;  // mean square of how far the motion leads astray

    void fade(double step_s);
    // `astray`: from the pose to where the motion led; `behind`: to what was shown last.
    void meet(const Eigen::Vector3d& astray, const Eigen::Vector3d& behind, bool changed, double least, double step_s);
  };

  std::vector<Fading> turns_;  // by bone, rotation vectors in the parent's frame
  Fading root_;                // m
  std::vector<Pose> shown_;
};

}  // namespace mocap::pose
