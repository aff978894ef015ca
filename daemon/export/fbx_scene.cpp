#include "export/fbx_scene.h"

#include <utility>

namespace mocap::exports {

using namespace std::string_view_literals;

FbxNode& FbxProperties::add(std::string_view name, std::string_view type, std::string_view label,
                            std::string_view flags) {
  return node_.child(FbxNode("P")).add(name).add(type).add(label).add(flags);
}

FbxProperties& FbxProperties::integer(std::string_view name, std::int32_t value) {
  add(name, "int", "Integer", "").add(value);
  return *this;
}

FbxProperties& FbxProperties::enumeration(std::string_view name, std::int32_t value) {
  add(name, "enum", "", "").add(value);
  return *this;
}

FbxProperties& FbxProperties::number(std::string_view name, double value) {
  add(name, "double", "Number", "").add(value);
  return *this;
}

FbxProperties& FbxProperties::text(std::string_view name, std::string_view value) {
  add(name, "KString", "", "").add(value);
  return *this;
}

FbxProperties& FbxProperties::time(std::string_view name, std::int64_t ticks) {
  add(name, "KTime", "Time", "").add(ticks);
  return *this;
}

FbxProperties& FbxProperties::colour(std::string_view name, double red, double green, double blue) {
  add(name, "ColorRGB", "Color", "").add(red).add(green).add(blue);
  return *this;
}

FbxProperties& FbxProperties::animated_number(std::string_view name, double value) {
  add(name, "Number", "", "A").add(value);
  return *this;
}

FbxProperties& FbxProperties::local(std::string_view name, double x, double y, double z) {
  add(name, name, "", "A").add(x).add(y).add(z);
  return *this;
}

FbxProperties& FbxProperties::object(std::string_view name) {
  add(name, "object", "", "");
  return *this;
}

FbxScene::Id FbxScene::add(const Kind& kind, std::string_view name, std::vector<FbxNode> content) {
  const Id id = next_++;
  ++counts_[std::string(kind.kind)];
  FbxNode& object = objects_.child(FbxNode(kind.kind));
  object.add(id).add(std::string(name) + std::string("\0\1"sv) + std::string(kind.tag)).add(kind.subtype);
  for (FbxNode& node : content) {
    object.child(std::move(node));
  }
  return id;
}

void FbxScene::connect(Id child, Id parent) { connections_.child(FbxNode("C")).add("OO").add(child).add(parent); }

void FbxScene::connect(Id child, Id parent, std::string_view property) {
  connections_.child(FbxNode("C")).add("OP").add(child).add(parent).add(property);
}

std::vector<FbxNode> FbxScene::records() && {
  counts_["GlobalSettings"] = 1;
  std::int32_t total = 0;
  for (const auto& [kind, count] : counts_) {
    total += count;
  }
  FbxNode definitions("Definitions");
  definitions.field("Version", 100).field("Count", total);
  for (const auto& [kind, count] : counts_) {
    definitions.child(FbxNode("ObjectType")).add(kind).field("Count", count);
  }
  std::vector<FbxNode> records;
  records.push_back(std::move(definitions));
  records.push_back(std::move(objects_));
  records.push_back(std::move(connections_));
  return records;
}

}  // namespace mocap::exports
