#pragma once

#include <string>

#include "export/bone_names.h"
#include "export/clip/clip.h"

namespace mocap::exports {

/// Writes all subjects as USD text (.usda) in the UsdSkel schema: for each subject a SkelRoot with its name that
/// contains a Skeleton, a SkelAnimation and a skinned stick mesh. In m, y up. Frame f of the clip has the time code f,
/// so the time is exact: timeCodesPerSecond is the frame rate. The first frame's number in the take is in
/// customLayerData.
///
/// The names of prims and joints have only letters, digits and `_`, as USD requires. If the clip has several subjects,
/// a joint has the subject as prefix (`Anna_Hips`), because some readers find joints by name alone. `jointNames` has
/// the names in the convention.
///
/// The clip has a frame and a subject; each subject has a bone.
///
/// Source: Pixar, OpenUSD documentation, "UsdSkel schemas".
std::string write_usd(const Clip& clip, BoneNames names);

}  // namespace mocap::exports
