#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

#include "scene/clip_actor.h"

namespace mocap::scene {
namespace {

struct Alias {
  std::string_view joint;  // as in human18, without the side
  std::string_view name;   // in lower case; without the side, spaces and punctuation
};

// CMU (both spellings), Mixamo and related, DeepMimic. In some conventions a thigh has the name of the hip joint.
constexpr std::array kAliases{
    Alias{"Hips", "hips"},       Alias{"Hips", "hip"},      Alias{"Hips", "root"},       Alias{"Hips", "pelvis"},
    Alias{"Chest", "chest"},     Alias{"Chest", "spine1"},  Alias{"Chest", "upperback"}, Alias{"Neck", "neck"},
    Alias{"Neck", "lowerneck"},  Alias{"Head", "head"},     Alias{"Collar", "collar"},   Alias{"Collar", "clavicle"},
    Alias{"UpArm", "shoulder"},  Alias{"UpArm", "arm"},     Alias{"UpArm", "uparm"},     Alias{"UpArm", "upperarm"},
    Alias{"UpArm", "humerus"},   Alias{"LowArm", "elbow"},  Alias{"LowArm", "forearm"},  Alias{"LowArm", "lowarm"},
    Alias{"LowArm", "lowerarm"}, Alias{"LowArm", "radius"}, Alias{"Hand", "wrist"},      Alias{"Hand", "hand"},
    Alias{"UpLeg", "hip"},       Alias{"UpLeg", "upleg"},   Alias{"UpLeg", "upperleg"},  Alias{"UpLeg", "thigh"},
    Alias{"UpLeg", "femur"},     Alias{"LowLeg", "knee"},   Alias{"LowLeg", "leg"},      Alias{"LowLeg", "lowleg"},
    Alias{"LowLeg", "lowerleg"}, Alias{"LowLeg", "shin"},   Alias{"LowLeg", "tibia"},    Alias{"Foot", "ankle"},
    Alias{"Foot", "foot"},
};

constexpr std::array<std::string_view, 18> kKnownJoints{
    "Hips",       "Chest",       "Neck",      "Head",       "LeftCollar",  "LeftUpArm",
    "LeftLowArm", "LeftHand",    "LeftUpLeg", "LeftLowLeg", "LeftFoot",    "RightCollar",
    "RightUpArm", "RightLowArm", "RightHand", "RightUpLeg", "RightLowLeg", "RightFoot"};

std::string_view find_joint(const std::string& joint) {
  const auto known = std::ranges::find(kKnownJoints, joint);
  return known == kKnownJoints.end() ? std::string_view{} : *known;
}

std::string_view find_alias(std::string_view side, std::string_view name) {
  for (const Alias& alias : kAliases) {
    if (alias.name != name) continue;
    const auto joint = find_joint(std::string(side) + std::string(alias.joint));
    if (!joint.empty()) return joint;
  }
  return {};
}

}  // namespace

std::string_view known_joint(std::string_view name) {
  name.remove_prefix(std::min(name.size(), name.rfind(':') + 1));  // npos + 1 is 0
  std::string plain;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  if (const auto middle = find_alias("", plain); !middle.empty()) return middle;
  for (const auto& [prefix, side] : {std::pair<std::string_view, std::string_view>{"left", "Left"},
                                     {"right", "Right"},
                                     {"l", "Left"},
                                     {"r", "Right"}}) {
    if (!plain.starts_with(prefix)) continue;
    const auto joint = find_alias(side, std::string_view(plain).substr(prefix.size()));
    if (!joint.empty()) return joint;
  }
  return {};
}

}  // namespace mocap::scene
