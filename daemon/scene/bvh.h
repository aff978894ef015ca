#pragma once

#include <Eigen/Geometry>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace mocap::scene {

enum class BvhChannel { XPosition, YPosition, ZPosition, XRotation, YRotation, ZRotation };

struct BvhJoint {
  std::string name;
  int parent = -1;                                   ///< index of an earlier joint; -1: the root
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from the parent, in the file's unit
  std::vector<BvhChannel> channels;                  ///< in the order of the file, which is the order of rotation
  std::size_t first_value = 0;                       ///< index of its first channel in a frame
};

/// The content of a BVH file in the unit, the axes and the joint names of the file. The pose with all rotations 0 is
/// the rest pose.
struct Bvh {
  std::vector<BvhJoint> joints;  ///< parents first
  double frame_time_s = 0.0;
  std::size_t values_a_frame = 0;
  std::size_t frames = 0;
  std::vector<double> values;  ///< frame after frame; degrees and the file's unit
};

/// The pose of a BVH skeleton at one instant.
struct BvhPosture {
  Eigen::Vector3d root = Eigen::Vector3d::Zero();  ///< position, in the file's unit
  std::vector<Eigen::Quaterniond> rotations;       ///< rotation relative to the parent, by joint
};

/// Reads the text of a BVH file with at least one joint, one channel and one frame. Fails with InvalidArgument and the
/// line of the fault.
Result<Bvh> parse_bvh(std::string_view text);

/// Writes the posture `t_s` after frame 0, limited to the frames of the file. Between frames, a cubic Catmull-Rom curve
/// (for rotations: the same with slerp) has continuous velocity. With linear interpolation, the velocity would jump at
/// each frame of a 30 Hz recording, which no real body does.
void posture_of(const Bvh& bvh, double t_s, BvhPosture& into);

}  // namespace mocap::scene
