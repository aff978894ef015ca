#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/functional/functional_body.h"
#include "scene/c3d.h"
#include "scene/import_marker_set.h"

namespace mocap::ctl {

/// A marker set from a C3D file, and the skeleton file that it belongs to.
struct MotionImport {
  scene::ImportedMarkerSet imported;
  std::vector<functional::FoundJoint> joints;
  std::filesystem::path skeleton_file;
};

/// Whether less than half of the markers of a file have a label of a known convention.
bool has_own_labels(const scene::C3d& c3d);

/// Finds bones and joints in the motion of the markers, whatever their labels are, and writes the skeleton `name` to
/// NAME.skeleton.toml in `folder`. Fails as functional::find_body and settings::save_skeleton do.
Result<MotionImport> import_by_motion(const scene::C3d& c3d, const std::string& name,
                                      const std::filesystem::path& folder);

}  // namespace mocap::ctl
