#include "bridges/natnet/bone_names.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace mocap::natnet {
namespace {

struct Names {
  std::string_view unity, motive, fbx, bvh;
};

// The bones of both sides stand once, without their side.
constexpr std::array kMiddle{
    Names{"Hips", "Hip", "Hips", "Hips"},        Names{"Spine", "Ab", "Spine", "Chest"},
    Names{"Chest", "Chest", "Spine1", "Chest2"}, Names{"UpperChest", "Chest2", "Spine2", "Chest3"},
    Names{"Neck", "Neck", "Neck", "Neck"},       Names{"Head", "Head", "Head", "Head"}};
constexpr std::array kSides{Names{"Shoulder", "Shoulder", "Shoulder", "Collar"},
                            Names{"UpperArm", "UArm", "Arm", "Shoulder"},
                            Names{"LowerArm", "FArm", "ForeArm", "Elbow"},
                            Names{"Hand", "Hand", "Hand", "Wrist"},
                            Names{"UpperLeg", "Thigh", "UpLeg", "Hip"},
                            Names{"LowerLeg", "Shin", "Leg", "Knee"},
                            Names{"Foot", "Foot", "Foot", "Ankle"},
                            Names{"Toes", "Toe", "ToeBase", "Toe"}};

std::string_view pick(const Names& names, Naming naming) {
  switch (naming) {
    case Naming::Motive: return names.motive;
    case Naming::Fbx: return names.fbx;
    case Naming::Bvh: return names.bvh;
  }
  return {};
}

template <class List>
std::string_view find(const List& list, std::string_view unity, Naming naming) {
  const auto* const found =
      std::find_if(list.begin(), list.end(), [&](const Names& one) { return one.unity == unity; });
  return found == list.end() ? std::string_view{} : pick(*found, naming);
}

}  // namespace

std::string bone_name(const Bone& bone, Naming naming) {
  const std::string_view unity = bone.unity_name;
  if (const std::string_view name = find(kMiddle, unity, naming); !name.empty()) return std::string(name);
  for (const std::string_view side : {std::string_view("Left"), std::string_view("Right")}) {
    if (unity.substr(0, side.size()) != side) continue;
    const std::string_view name = find(kSides, unity.substr(side.size()), naming);
    if (name.empty()) continue;
    // Motive's short names have the first letter of the side.
    return std::string(naming == Naming::Motive ? side.substr(0, 1) : side) + std::string(name);
  }
  return bone.name;
}

}  // namespace mocap::natnet
