#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "model/skeleton.h"

namespace mocap::exports {

/// The convention of the bone names in a file.
enum class BoneNames {
  Skeleton,        ///< the names of the skeleton's file
  HumanBodyBones,  ///< Unity
  Mannequin,       ///< Unreal
  Mixamo,
  HumanIk,  ///< MotionBuilder, Maya
};

/// The convention with the name `skeleton`, `humanbodybones`, `mannequin`, `mixamo` or `humanik`; empty if there is no
/// such convention.
std::optional<BoneNames> bone_names_called(std::string_view name);

/// The names of all bones in a convention, by bone. A bone that the convention does not know keeps its own name. All
/// names of a skeleton differ: a name that occurs again has the suffix `_2`, `_3` and so on.
std::vector<std::string> bone_names(const Skeleton& skeleton, BoneNames convention);

/// Makes the names differ from each other, as `bone_names` does.
std::vector<std::string> made_unique(std::vector<std::string> names);

}  // namespace mocap::exports
