#include "bridges/natnet/settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace mocap::natnet {
namespace {

struct Switch {
  std::string_view name;
  bool Settings::*value;  // nullptr: a section that is always empty here, so its switch changes nothing
};

constexpr std::array kSwitches{Switch{"Labeled Markers", &Settings::labelled},
                               Switch{"Unlabeled Markers", &Settings::unlabelled},
                               Switch{"Asset Markers", &Settings::marker_sets},
                               Switch{"Marker Sets", &Settings::marker_sets},
                               Switch{"Rigid Bodies", &Settings::bodies},
                               Switch{"Skeletons", &Settings::skeletons},
                               Switch{"Trained Markerset Markers", nullptr},
                               Switch{"Trained Markerset Bones", nullptr},
                               Switch{"Devices", nullptr}};

constexpr std::string_view kCoordinates = "Skeleton Coordinates";
constexpr std::string_view kNaming = "Bone Naming Convention";
constexpr std::string_view kUpAxis = "Up Axis";
constexpr std::array kNamings{std::pair{std::string_view("Motive"), Naming::Motive},
                              std::pair{std::string_view("FBX"), Naming::Fbx},
                              std::pair{std::string_view("BVH"), Naming::Bvh}};

const Switch* find_switch(std::string_view name) {
  const auto* const found =
      std::find_if(kSwitches.begin(), kSwitches.end(), [&](const Switch& one) { return one.name == name; });
  return found == kSwitches.end() ? nullptr : found;
}

std::optional<bool> read_bool(std::string_view text) {
  if (text == "true" || text == "True" || text == "1") return true;
  if (text == "false" || text == "False" || text == "0") return false;
  return std::nullopt;
}

std::string_view name_of(Naming naming) {
  for (const auto& [name, value] : kNamings) {
    if (value == naming) return name;
  }
  return {};
}

bool set_choice(Settings& settings, std::string_view name, std::string_view value) {
  if (name == kCoordinates && (value == "Local" || value == "Global")) {
    settings.local_bones = value == "Local";
    return true;
  }
  if (name == kUpAxis && (value == "Y-Axis" || value == "Z-Axis")) {
    settings.up = value == "Z-Axis" ? UpAxis::Z : UpAxis::Y;
    return true;
  }
  if (name != kNaming) return false;
  for (const auto& [word, naming] : kNamings) {
    if (word != value) continue;
    settings.naming = naming;
    return true;
  }
  return false;
}

bool section_is_on(const Settings& settings, Kind kind) {
  switch (kind) {
    case Kind::MarkerSet: return settings.marker_sets;
    case Kind::Body: return settings.bodies;
    case Kind::Skeleton: return settings.skeletons;
  }
  return false;
}

}  // namespace

bool wants(const Settings& settings, Kind kind, std::string_view name, int id) {
  if (!section_is_on(settings, kind)) return false;
  if (!is_filtered(settings)) return true;
  return std::any_of(settings.subscriptions.begin(), settings.subscriptions.end(), [&](const Subscription& one) {
    return one.kind == kind && (one.name.empty() || one.name == name) && (one.id == 0 || one.id == id);
  });
}

bool set_property(Settings& settings, std::string_view name, std::string_view value) {
  const Switch* const found = find_switch(name);
  if (found == nullptr) return set_choice(settings, name, value);
  const std::optional<bool> on = read_bool(value);
  if (on && found->value != nullptr) settings.*(found->value) = *on;
  return on.has_value();
}

std::optional<std::string> get_property(const Settings& settings, std::string_view name) {
  if (name == kCoordinates) return settings.local_bones ? "Local" : "Global";
  if (name == kUpAxis) return settings.up == UpAxis::Y ? "Y-Axis" : "Z-Axis";
  if (name == kNaming) return std::string(name_of(settings.naming));
  const Switch* const found = find_switch(name);
  if (found == nullptr) return std::nullopt;
  return found->value != nullptr && settings.*(found->value) ? "true" : "false";
}

std::string to_string(const Settings& settings) {
  return fmt::format("{} {} {} {}", to_string(settings.version), settings.up == UpAxis::Y ? "y-up" : "z-up",
                     settings.local_bones ? "local" : "global", name_of(settings.naming));
}

}  // namespace mocap::natnet
