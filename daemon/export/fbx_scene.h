#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "export/fbx_node.h"

namespace mocap::exports {

/// The block `Properties70` of an FBX object.
class FbxProperties {
 public:
  FbxProperties& integer(std::string_view name, std::int32_t value);
  FbxProperties& enumeration(std::string_view name, std::int32_t value);
  FbxProperties& number(std::string_view name, double value);
  FbxProperties& text(std::string_view name, std::string_view value);
  FbxProperties& time(std::string_view name, std::int64_t ticks);
  FbxProperties& colour(std::string_view name, double red, double green, double blue);
  /// A component of an animated value: `d|X` and so on.
  FbxProperties& animated_number(std::string_view name, double value);
  /// `Lcl Translation`, `Lcl Rotation` or `Lcl Scaling`, whose name is also their type.
  FbxProperties& local(std::string_view name, double x, double y, double z);
  FbxProperties& object(std::string_view name);

  FbxNode node() const { return node_; }

 private:
  FbxNode& add(std::string_view name, std::string_view type, std::string_view label, std::string_view flags);

  FbxNode node_{"Properties70"};
};

/// The objects of an FBX file and their connections.
class FbxScene {
 public:
  using Id = std::int64_t;
  /// The scene itself: the parent of objects without another parent.
  static constexpr Id kRoot = 0;

  /// An object of a class that still has no id. `kind` is the record's name ("Model"), `tag` the class that belongs to
  /// the name ("Model", "SubDeformer"), `subtype` the third property ("LimbNode").
  struct Kind {
    std::string_view kind;
    std::string_view tag;
    std::string_view subtype;
  };

  /// Adds an object with these records; returns its id.
  Id add(const Kind& kind, std::string_view name, std::vector<FbxNode> content);
  /// Connects an object with its parent, or with a property of its parent.
  void connect(Id child, Id parent);
  void connect(Id child, Id parent, std::string_view property);

  /// The top-level records Definitions, Objects and Connections.
  std::vector<FbxNode> records() &&;

 private:
  Id next_ = 1'000'000;  // ids below may belong to the scene
  std::map<std::string, std::int32_t> counts_;
  FbxNode objects_{"Objects"};
  FbxNode connections_{"Connections"};
};

}  // namespace mocap::exports
