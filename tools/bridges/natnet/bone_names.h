#pragma once

#include <string>

#include "bridges/natnet/scene.h"
#include "bridges/natnet/settings.h"

namespace mocap::natnet {

/// The name of a bone in a naming convention. A bone without a name in Unity's HumanBodyBones keeps the name that it
/// has in the feed.
std::string bone_name(const Bone& bone, Naming naming);

}  // namespace mocap::natnet
