#include "export/bone_names.h"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "export/humanik_names.h"

namespace mocap::exports {
namespace {

constexpr std::array<std::pair<std::string_view, BoneNames>, 5> kConventions{{
    {"skeleton", BoneNames::Skeleton},
    {"humanbodybones", BoneNames::HumanBodyBones},
    {"mannequin", BoneNames::Mannequin},
    {"mixamo", BoneNames::Mixamo},
    {"humanik", BoneNames::HumanIk},
}};

// Empty if HumanIK has no such bone.
std::string human_ik_name(const std::string& unity) {
  const auto* const found = std::ranges::find(kHumanIkNames, unity, [](const auto& pair) { return pair.first; });
  return found == kHumanIkNames.end() ? std::string() : std::string(found->second);
}

// Empty if the convention has no such bone.
std::string alias_of(const Bone& bone, BoneNames convention) {
  switch (convention) {
    case BoneNames::Skeleton: return bone.name;
    case BoneNames::HumanBodyBones: return bone.aliases.unity;
    case BoneNames::Mannequin: return bone.aliases.unreal;
    case BoneNames::HumanIk: return human_ik_name(bone.aliases.unity);
    case BoneNames::Mixamo: {
      const std::string name = human_ik_name(bone.aliases.unity);
      return name.empty() ? name : "mixamorig:" + name;
    }
  }
  return bone.name;
}

}  // namespace

std::optional<BoneNames> bone_names_called(std::string_view name) {
  const auto* const found = std::ranges::find(kConventions, name, [](const auto& pair) { return pair.first; });
  return found == kConventions.end() ? std::nullopt : std::optional(found->second);
}

std::vector<std::string> bone_names(const Skeleton& skeleton, BoneNames convention) {
  std::vector<std::string> names;
  for (const Bone& bone : skeleton.bones) {
    const std::string alias = alias_of(bone, convention);
    names.push_back(alias.empty() ? bone.name : alias);
  }
  return made_unique(std::move(names));
}

std::vector<std::string> made_unique(std::vector<std::string> names) {
  std::set<std::string> used;
  for (std::string& name : names) {
    const std::string base = name;
    for (int number = 2; !used.insert(name).second; ++number) {
      name = base + "_" + std::to_string(number);
    }
  }
  return names;
}

}  // namespace mocap::exports
