#include "calibration/formats/yaml_camera.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace mocap::calibration {

const YamlValue* YamlCamera::require(std::initializer_list<const char*> keys, const char* expected) {
  const YamlValue* found = table_.find(keys);
  if (found == nullptr) add_fault(table_, fmt::format("has no {}, expected {}", *keys.begin(), expected));
  return found;
}

bool YamlCamera::append_numbers(const YamlValue& value, std::vector<double>& all, const char* key) {
  if (value.kind == YamlValue::Kind::List) {
    return std::ranges::all_of(value.list, [&](const YamlValue& item) { return append_numbers(item, all, key); });
  }
  if (value.kind == YamlValue::Kind::Table) {
    if (const YamlValue* data = value.find({"data"})) return append_numbers(*data, all, key);
  }
  const auto number = value.kind == YamlValue::Kind::Word ? number_of(value.word) : std::nullopt;
  if (!number) {
    add_fault(value, fmt::format("{} has '{}', expected finite numbers", key, value.word));
    return false;
  }
  all.push_back(*number);
  return true;
}

std::optional<std::vector<double>> YamlCamera::numbers(const YamlValue& value, const char* key,
                                                       std::initializer_list<std::size_t> counts) {
  std::vector<double> found;
  if (!append_numbers(value, found, key)) return std::nullopt;
  if (counts.size() > 0 && std::ranges::find(counts, found.size()) == counts.end()) {
    add_fault(value, fmt::format("{} has {} numbers, expected {}", key, found.size(), fmt::join(counts, " or ")));
    return std::nullopt;
  }
  return found;
}

void YamlCamera::add_fault(const YamlValue& at, const std::string& what) {
  faults_.add(at.at, fmt::format("camera '{}': {}", name_, what));
  is_valid_ = false;
}

}  // namespace mocap::calibration
