#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::exports {

/// One node record of a binary FBX file: a name, properties with a type each, and nested records.
///
/// Source: Blender Foundation, "FBX binary file format specification" (code.blender.org, 2013).
class FbxNode {
 public:
  explicit FbxNode(std::string_view name) : name_(name) {}

  // Each adds a property and returns the node, so that calls can be chained.
  FbxNode& add(bool value);
  FbxNode& add(std::int32_t value);
  FbxNode& add(std::int64_t value);
  FbxNode& add(double value);
  FbxNode& add(std::string_view text);
  FbxNode& add(const char* text) { return add(std::string_view(text)); }
  FbxNode& add_raw(std::string_view bytes);
  FbxNode& add(std::span<const std::int32_t> values);
  FbxNode& add(std::span<const std::int64_t> values);
  FbxNode& add(std::span<const float> values);
  FbxNode& add(std::span<const double> values);

  /// Adds a nested record and returns that record; the reference is valid until the next nested record is added.
  FbxNode& child(FbxNode node);
  /// Adds a nested record with one property.
  template <class Value>
  FbxNode& field(std::string_view name, const Value& value) {
    FbxNode& made = child(FbxNode(name));
    made.add(value);
    return *this;
  }

  /// Appends the record to a file that so far has the bytes `file`, because a record states where it ends. A record
  /// ends below 4 GiB.
  void append_to(std::string& file) const;

  /// Upper bound of the size of the record in bytes.
  std::size_t size_bound() const;

 private:
  void add_type(char type);
  template <class Value>
  FbxNode& add_value(char type, const Value& value);
  template <class Value>
  FbxNode& add_array(char type, std::span<const Value> values);

  std::string name_;
  std::uint32_t property_count_ = 0;
  std::string properties_;
  std::vector<FbxNode> children_;
};

/// The file of the top-level records: header, records, footer of version 7400. Below 4 GiB.
std::string fbx_file(std::span<const FbxNode> records);

/// Version of the file format.
inline constexpr std::int32_t kFbxVersion = 7400;

/// The identity that belongs to the constant creation time of the file; a reader of Autodesk checks it against the
/// footer.
inline constexpr std::string_view kFbxCreationTime = "1970-01-01 10:00:00:000";
std::string_view fbx_file_id();

}  // namespace mocap::exports
