#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.h"
#include "model/transform.h"

namespace mocap::pose {

/// Eases a pose discontinuity that a change of the observing markers causes: a marker that returns after a gap shows
/// that a limb is elsewhere than predicted. The difference between prediction and pose decays as a critically damped
/// spring, with neither position nor velocity discontinuous, to a tenth within 0.16 s. If the last published pose is
/// nearer to the new pose than the prediction is, the difference to the published pose decays instead, from rest. While
/// the same markers observe a bone, its motion is not changed, however fast it is.
///
/// Allocates in the constructor only.
class PoseTransitionSmoother {
 public:
  explicit PoseTransitionSmoother(std::size_t bones);

  /// Drops all decaying offsets.
  void reset();

  /// One instant, `step_s` after the last. `poses` are the estimated local poses, `predicted` the local poses that the
  /// motion model predicted, and `changed` is not 0 for bones that other markers observe than before. Returns the poses
  /// to publish, valid until the next call.
  std::span<const Pose> step(std::span<const Pose> poses, std::span<const Pose> predicted,
                             std::span<const std::uint8_t> changed, double step_s);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(joint_offsets_, root_offset_, shown_); }

 private:
  // Of a joint in rad, of the root in m.
  struct DecayingOffset {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();    // rad or m
    Eigen::Vector3d rate_1_s = Eigen::Vector3d::Zero();  // change of the offset: rad/s or m/s
    double mean_square = 0.0;                            // running mean of the squared prediction error, rad^2 or m^2

    void decay(double step_s);
    // `prediction_error` is predicted minus estimated pose, `display_error` published minus estimated pose.
    void absorb_jump(const Eigen::Vector3d& prediction_error, const Eigen::Vector3d& display_error, bool changed,
                     double min_jump, double step_s);
    void archive(Archive& members) { members(offset, rate_1_s, mean_square); }
  };

  std::vector<DecayingOffset> joint_offsets_;  // by bone, rotation vectors in the parent's frame
  DecayingOffset root_offset_;                 // of the root's position in the world
  std::vector<Pose> shown_;
};

}  // namespace mocap::pose
