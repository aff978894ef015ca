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
  int parent = -1;                                   ///< stands before this one; -1: the root
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< from the parent, in the file's unit
  std::vector<BvhChannel> channels;                  ///< in the order of the file, which is the order of rotation
  std::size_t first_value = 0;                       ///< of its channels in a frame
};

/// A motion as a BVH file tells it: the file's own unit, axes and names. All rotations 0 is its rest pose.
struct Bvh {
  std::vector<BvhJoint> joints;  ///< parents first
  double frame_time_s = 0.0;
  std::size_t values_a_frame = 0;
  std::size_t frames = 0;
  std::vector<double> values;  ///< frame by frame; degrees and the file's unit
};

/// How the joints of a BVH stand at one instant.
struct BvhPosture {
  Eigen::Vector3d root = Eigen::Vector3d::Zero();  ///< in the file's unit
  std::vector<Eigen::Quaterniond> turns;           ///< against the parent, by joint
};

/// Reads the text of a BVH file. Fails with InvalidArgument, with the line at fault. Without at least one joint and one
/// frame it is no motion.
Result<Bvh> parse_bvh(std::string_view text);

/// The posture at any instant from frame 0 on; clamped to the first and the last. Between frames the way bends so that
/// velocities have no jump at a frame (cubics through the frames, of Catmull and Rom's slopes; on turns by slerps):
/// a body has mass, and evenly turned stretches between the frames of a recording of 30 Hz would knock at each of them.
void posture_of(const Bvh& bvh, double t_s, BvhPosture& into);

}  // namespace mocap::scene
