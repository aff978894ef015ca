#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "calibrate/formats_reader.h"

namespace mocap::calibrate {
namespace {

// A calibration has some hundred values; aliases could make a small file huge.
constexpr int kMostValues = 200000;
constexpr int kDeepest = 32;

Place place_of(const YAML::Mark& mark) {
  if (mark.is_null()) return {};
  return {static_cast<std::uint32_t>(mark.line + 1), static_cast<std::uint32_t>(mark.column + 1)};
}

/// Copies yaml-cpp's tree; false where it is deeper or larger than any calibration.
class Copier {
 public:
  bool copy(const YAML::Node& node, YamlValue& into, int depth) {
    if (depth > kDeepest || ++values_ > kMostValues) return false;
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

settings::Faults one_fault(const std::filesystem::path& path, const Place& at, std::string message) {
  return {path, {{path, at.line, at.column, std::move(message)}}};
}

}  // namespace

const YamlValue* YamlValue::find(std::initializer_list<const char*> keys) const {
  for (const char* key : keys) {
    for (const auto& [name, value] : table) {
      if (name == key) return &value;
    }
  }
  return nullptr;
}

Result<YamlValue, settings::Faults> parse_yaml(const std::filesystem::path& path, const std::string& text) {
  // OpenCV's first line, %YAML:1.0, is no directive of YAML: it becomes a comment, so that lines keep their numbers.
  std::string plain = text;
  if (plain.starts_with("%YAML:")) plain[0] = '#';
  try {
    YamlValue value;
    if (!Copier().copy(YAML::Load(plain), value, 0)) {
      return one_fault(path, {}, "is deeper or larger than a calibration can be");
    }
    if (value.kind != YamlValue::Kind::Table)
      return one_fault(path, {1, 1}, "is no YAML table, expected one of cameras");
    return value;
  } catch (const YAML::Exception& error) {
    return one_fault(path, place_of(error.mark), "is no YAML: " + error.msg);
  }
}

}  // namespace mocap::calibrate
