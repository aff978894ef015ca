#pragma once

#include <memory>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "scene/actor.h"
#include "scene/bvh.h"
#include "scene/c3d.h"

namespace mocap::scene {

struct BvhSettings {
  double unit_m = 0.0;    ///< unit of the file; 0: the rest pose is 1.75 m tall (1.60 m from lowest to highest joint)
  double t_pose_s = 2.0;  ///< duration of the rest pose before the motion, with its heading; then 1 s of transition
  double arms_lowered_rad = 0.0;  ///< angle of the arms in that rest pose: 0 is T-pose, pi / 4 is A-pose
};

/// An actor with the motion of a BVH file, played forward and backward without end (see there_and_back_s). The motion
/// starts at the second frame, as the first is often a rest pose. The path is centred in the volume, and the lowest
/// joint of the whole motion is on the floor.
///
/// With a marker set, the skeleton of the set is moved: bones with names of human18 take the rotations of the
/// corresponding joints of the file (CMU, Mixamo or DeepMimic names), and the limbs have the directions of the file's
/// limbs; the rest pose is the T-pose. Without a marker set, the skeleton of the file is moved, with a marker on each
/// joint that is apart from its parent. Joints get the names of human18 where known.
///
/// Fails with InvalidArgument if the file has more joints than a subject may have, or if fewer than two joints are
/// known.
Result<std::unique_ptr<Actor>> make_bvh_actor(Bvh bvh, std::optional<MarkerSet> marker_set,
                                              const BvhSettings& settings);

/// An actor with the labelled markers of a C3D file, played forward and backward without end, centred in the volume,
/// with linear interpolation between samples and z up. Unlabelled points are ghosts; model outputs are omitted. The
/// marker set has one bone, and the states have no bone poses. Fails with InvalidArgument if the file has no marker or
/// more markers than a subject may have.
Result<std::unique_ptr<Actor>> make_c3d_actor(C3d c3d);

/// The name in human18 of a joint with a name of another program; empty: unknown.
std::string_view known_joint(std::string_view name);

}  // namespace mocap::scene
