#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bridges/natnet/version.h"

namespace mocap::natnet {

enum class UpAxis { Y, Z };
enum class Naming { Motive, Fbx, Bvh };
enum class Kind { MarkerSet, Body, Skeleton };

/// The data that a client asked for with SubscribeToData and SubscribeByID.
struct Subscription {
  Kind kind = Kind::Body;
  std::string name;  ///< empty: all of the kind, or the one with `id`
  int id = 0;        ///< 0: any

  bool operator==(const Subscription&) const = default;
};

/// What one client receives. The defaults are those of the servers that clients of NatNet know.
struct Settings {
  Version version;
  UpAxis up = UpAxis::Y;
  Naming naming = Naming::Motive;
  bool local_bones = false;  ///< poses of bones relative to the parent bone, else to the world
  bool marker_sets = true;
  bool labelled = true;
  bool unlabelled = true;  ///< only together with labelled
  bool bodies = true;
  bool skeletons = true;
  std::vector<Subscription> subscriptions;
  std::string take_name;         ///< of the next take that the client starts
  bool subscribed_only = false;  ///< without a subscription the client gets nothing, else everything

  bool operator==(const Settings&) const = default;
};

/// Whether the client gets subscribed parts only.
inline bool is_filtered(const Settings& settings) {
  return settings.subscribed_only || !settings.subscriptions.empty();
}

/// Whether the client gets this part: its section is on, and it is subscribed or nothing is.
bool wants(const Settings& settings, Kind kind, std::string_view name, int id);

/// Sets the property `name` of SetProperty. False if the name or the value is unknown.
bool set_property(Settings& settings, std::string_view name, std::string_view value);

/// The value of a property; empty if the name is unknown.
std::optional<std::string> get_property(const Settings& settings, std::string_view name);

/// "4.1 y-up global Motive".
std::string to_string(const Settings& settings);

}  // namespace mocap::natnet
