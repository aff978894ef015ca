#pragma once

#include <span>
#include <string_view>

#include "mocap_client.h"

namespace mocap::rokoko {

enum class Section { Body, LeftGlove, RightGlove };

/// A bone of Rokoko's body.
struct Bone {
  std::string_view name;
  std::string_view unity_name;  ///< in HumanBodyBones; empty: none
  int parent;                   ///< index; -1: none. Parents come first.
  Section section;
  mocap_quat rest;  ///< rotation in the T-pose, in Unity's axes
};

/// All bones: 23 of the body, then 20 of each hand.
///
/// Source of names and rotations: the T-pose of Rokoko Studio, as its plug-in for Blender lists it
/// (github.com/Rokoko/rokoko-studio-live-blender, core/animation_lists.py).
std::span<const Bone> all_bones();

}  // namespace mocap::rokoko
