#pragma once

#include <string>

#include "base/result.h"
#include "export/bone_names.h"
#include "export/clip/clip.h"

namespace mocap::exports {

/// Writes all subjects as one binary FBX file, version 7.4: for each subject limb nodes, a skinned stick mesh and a
/// bind pose. One animation stack moves all subjects; its first key has the time 0. In cm, y up, facing +z, as Maya and
/// MotionBuilder do.
///
/// If the clip has several subjects, a null with the name of the subject holds its bones, which have the subject as
/// namespace (`Anna:Hips`): readers find bones by name, and Blender makes one armature for each null. One subject alone
/// has neither, so that engines import the takes of all persons into one skeleton.
///
/// The clip has a frame and a subject; each subject has a bone. Fails with Unsupported if the file would exceed the 4
/// GiB of the format.
///
/// Source: Blender Foundation, "FBX binary file format specification" (2013), and the documentation of the FBX SDK
/// 2020.
Result<std::string> write_fbx(const Clip& clip, BoneNames names);

}  // namespace mocap::exports
