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
class PoseTransitionSmoother {
 public:
  explicit PoseTransitionSmoother(std::size_t bones);

  /// Nothing fades any more.
  void reset();

  /// One instant, `step_s` after the last: `poses` are the local poses that were found, `predicted` those that the
  /// motion led to, and `changed` says of each bone whether other markers tell it than before. Gives what is to be
  /// shown.
  std::span<const Pose> step(std::span<const Pose> poses, std::span<const Pose> predicted,
                             std::span<const std::uint8_t> changed, double step_s);

 private:
  struct DecayingOffset {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
    Eigen::Vector3d rate_1_s = Eigen::Vector3d::Zero();
    double mean_square = 0.0;  // mean square of how far the motion leads astray

    void decay(double step_s);
    // `prediction_error`: from the pose to where the motion led; `display_error`: to what was shown last.
    void absorb_jump(const Eigen::Vector3d& prediction_error, const Eigen::Vector3d& display_error, bool changed,
                     double min_jump, double step_s);
  };

  std::vector<DecayingOffset> joint_offsets_;  // by bone, rotation vectors in the parent's frame
  DecayingOffset root_offset_;                 // m
  std::vector<Pose> shown_;
};

}  // namespace mocap::pose
