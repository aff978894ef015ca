#pragma once

#include <memory>
#include <optional>

#include "base/result.h"
#include "scene/actor.h"
#include "scene/bvh.h"
#include "scene/c3d.h"

namespace mocap::scene {

struct BvhSettings {
  double unit_m = 0.0;    ///< of the file; 0: so that its rest pose is 1.75 m tall (1.60 m without feet and crown)
  double t_pose_s = 2.0;  ///< somebody stands in the rest pose first, facing as the motion begins; gets into it in 1 s
  double arms_lowered_rad = 0.0;  ///< meanwhile: 0 is T-pose, a quarter of pi A-pose
};

/// Somebody who moves as a BVH file tells (from its second frame on: the first is often a rest pose), forth and back
/// without end (turning round as there_and_back_s tells), in the middle of the volume, with the lowest joint of the
/// whole motion on the floor.
///
/// With a marker set its own skeleton is moved: the bones named as in human18 take the turns of the joints that are
/// called so elsewhere (CMU, Mixamo, DeepMimic names), limbs point where the file's limbs point; the rest pose is the
/// T-pose. Without one the file's own skeleton is moved, with a marker on each joint that lies apart from its parent,
/// and joints keep their names where human18 has none for them.
///
/// Fails with InvalidArgument when the file has more joints than a subject may have, or no joint that is known.
Result<std::unique_ptr<Actor>> make_bvh_actor(Bvh bvh, std::optional<MarkerSet> marker_set,
                                              const BvhSettings& settings);

/// The labelled markers of a C3D file, forth and back without end, in the middle of the volume, evenly between
/// samples, up along z whatever the file's axis is. Nameless points are ghosts; a model's outputs are left out. The
/// marker set has one bone; no poses. Fails with InvalidArgument when there are no markers or more than a subject may
/// have.
Result<std::unique_ptr<Actor>> make_c3d_actor(C3d c3d);

/// The name that human18 has for a joint as other programs call it; empty where it has none.
std::string_view known_joint(std::string_view name);

}  // namespace mocap::scene
