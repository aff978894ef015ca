#pragma once

#include "base/archive.h"
#include "model/skeleton.h"

namespace mocap::kinematics {

/// Writes or reads the members of a marker set that a fit changes: rest offsets of the bones and offsets of the
/// markers.
inline void archive_offsets(MarkerSet& set, Archive& members) {
  for (Bone& bone : set.skeleton.bones) members(bone.rest_offset_m);
  for (MarkerOnBone& marker : set.markers) members(marker.offset_m);
}

}  // namespace mocap::kinematics
