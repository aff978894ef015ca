#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "lib/functional/functional_body.h"
#include "scene/c3d.h"
#include "scene/import_marker_set.h"

namespace mocap::functional {

/// A marker set that was made from a C3D file without regard to its labels.
struct MotionImport {
  scene::ImportedMarkerSet imported = {};
  std::vector<FoundJoint> joints = {};
  std::vector<std::string> left_out = {};  ///< markers that have no joint to the others
};

/// Whether less than half of the markers of a file have a label of a convention (scene::known_marker).
bool has_own_labels(const scene::C3d& c3d);

/// Finds bones and joints in the motion of the markers, whatever their labels are. `name` becomes the name of the
/// marker set and of its skeleton. Fails as find_body does.
Result<MotionImport> import_by_motion(const scene::C3d& c3d, const std::string& name);

}  // namespace mocap::functional
