#pragma once

#include <cstddef>
#include <string>

#include "export/bone_names.h"
#include "export/clip/clip.h"

namespace mocap::exports {

struct BvhSettings {
  BoneNames names = BoneNames::Skeleton;
  double units_per_m = 100.0;  ///< 100: the file is in cm, as most readers expect
};

/// Writes one subject as BVH (Biovision hierarchy), y up. The root has the offset 0 and the only position channels; a
/// joint that moves relative to its parent stays at its rest offset. Joints without children have an end site. The rest
/// pose, with all angles 0, is the T-pose. The first frame has the time 0.
///
/// The clip has a frame and `subject` is below the number of its subjects; the subject has a bone.
///
/// Source: Meredith and Maddock, Motion capture file formats explained (2001), section 2.
std::string write_bvh(const Clip& clip, std::size_t subject, const BvhSettings& settings);

}  // namespace mocap::exports
