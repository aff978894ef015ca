#pragma once

#include <cstddef>
#include <vector>

#include "export/clip/clip.h"
#include "export/skinned_skeleton.h"
#include "model/transform.h"

namespace mocap::exports {

/// The motion of all bones of one subject without gaps, in m and the axes of `to_y_up`.
class JointMotion {
 public:
  /// A lost bone keeps its last pose relative to its parent. Before its first pose it has that first pose; a bone that
  /// is lost in all frames stays in bind pose. A pose that is not finite counts as lost. `skeleton` is of this subject.
  JointMotion(const Clip& clip, std::size_t subject, const SkinnedSkeleton& skeleton);

  std::size_t frames() const noexcept { return frames_; }
  std::size_t bones() const noexcept { return bones_; }
  /// Pose relative to the parent; of the root: to the world. The quaternions of successive frames have a dot product of
  /// 0 or more, so that interpolation takes the shorter way.
  const Pose& parent_from_bone(std::size_t frame, std::size_t bone) const { return poses_[frame * bones_ + bone]; }
  /// Whether the bone's joint moves relative to its parent, by more than a rounding error.
  bool translates(std::size_t bone) const { return translates_[bone]; }

 private:
  std::size_t frames_;
  std::size_t bones_;
  std::vector<Pose> poses_;       // by frame, then by bone
  std::vector<bool> translates_;  // by bone
};

}  // namespace mocap::exports
