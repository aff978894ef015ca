#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "calibration/formats/format_reader.h"

namespace mocap::calibration {
namespace {

// A calibration has some hundred values. Aliases could expand a small file to a huge tree.
constexpr int kMaxValues = 200000;
constexpr int kMaxDepth = 32;

TextPlace place_of(const YAML::Mark& mark) {
  if (mark.is_null()) return {};
  return {static_cast<std::uint32_t>(mark.line + 1), static_cast<std::uint32_t>(mark.column + 1)};
}

/// Copies the tree of yaml-cpp; false if the tree is deeper or larger than a calibration can be.
class TreeCopier {
 public:
  bool copy(const YAML::Node& node, YamlValue& into, int depth) {
    if (depth > kMaxDepth || ++values_ > kMaxValues) return false;
    into.at = place_of(node.Mark());
    if (node.IsScalar()) {
      into.kind = YamlValue::Kind::Word;
      into.word = node.Scalar();
    } else if (node.IsSequence()) {
      into.kind = YamlValue::Kind::List;
      for (const YAML::Node& item : node) {
        into.list.emplace_back();
        if (!copy(item, into.list.back(), depth + 1)) return false;
      }
    } else if (node.IsMap()) {
      into.kind = YamlValue::Kind::Table;
      for (const auto& item : node) {
        into.table.emplace_back(item.first.IsScalar() ? item.first.Scalar() : std::string(), YamlValue{});
        if (!copy(item.second, into.table.back().second, depth + 1)) return false;
      }
    }
    return true;
  }

 private:
  int values_ = 0;
};

FormatFaults one_fault(const TextPlace& at, std::string message) { return {{at.line, at.column, std::move(message)}}; }

}  // namespace

const YamlValue* YamlValue::find(std::initializer_list<const char*> keys) const {
  for (const char* key : keys) {
    for (const auto& [name, value] : table) {
      if (name == key) return &value;
    }
  }
  return nullptr;
}

Result<YamlValue, FormatFaults> parse_yaml(const std::string& text) {
  // OpenCV's first line, %YAML:1.0, is not a YAML directive. As a comment it keeps the line numbers.
  std::string plain = text;
  if (plain.starts_with("%YAML:")) plain[0] = '#';
  try {
    YamlValue value;
    if (!TreeCopier().copy(YAML::Load(plain), value, 0)) {
      return one_fault({}, "is deeper or larger than a calibration can be");
    }
    if (value.kind != YamlValue::Kind::Table)
      return one_fault({1, 1}, "is not a YAML table, expected a table of cameras");
    return value;
  } catch (const YAML::Exception& error) {
    return one_fault(place_of(error.mark), "is not YAML: " + error.msg);
  }
}

}  // namespace mocap::calibration
