#pragma once

#include <string>

#include "base/result.h"
#include "export/bone_names.h"
#include "export/clip/clip.h"

namespace mocap::exports {

/// Writes all subjects as one binary glTF 2.0 file (.glb): for each subject a node with its name that contains the
/// joints, and a skinned stick mesh. One animation moves all subjects; its first key has the time 0. In m, y up. The
/// first frame's number in the take and the exact rate are in `extras` of the scene.
///
/// The clip has a frame and a subject; each subject has a bone. Fails with Unsupported if the file would exceed the 4
/// GiB of the format.
///
/// Source: Khronos, glTF 2.0 specification (2021).
Result<std::string> write_gltf(const Clip& clip, BoneNames names);

}  // namespace mocap::exports
