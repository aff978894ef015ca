#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <vector>

#include "base/time.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/skeleton.h"

namespace mocap::join {

/// Keeps the pose of a subject from jumping where another chunk goes on: the difference between the poses of both
/// chunks in their common set is added to the later poses, and becomes zero within kDecay.
///
/// A rotation differs in the frame of its bone, so that a bone keeps its direction where only the rotation about its
/// own axis differs, which no marker may observe. Joints follow from the root on. Source: D. Bollo, "Inertialization:
/// High-Performance Animation Transitions in Gears of War" (GDC 2018).
class PoseOffset {
 public:
  static constexpr Duration kDecay = std::chrono::seconds(1);

  /// States of one subject in one set: of the earlier and of the later chunk. Bones that one of them has lost, and all
  /// if columns have the wrong length, get no offset.
  PoseOffset(const v1::SubjectState& earlier, const v1::SubjectState& later, const Skeleton& skeleton);

  /// `since`: time since the common set, at least 0.
  void add_to(v1::SubjectState& state, Duration since) const;

 private:
  struct BoneOffset {
    int parent = -1;
    Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< in the frame of the bone
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< in the frame of the parent; of the root: the world
  };

  std::vector<BoneOffset> bones_;  // empty: none
};

}  // namespace mocap::join
