#include "calibrate/formats_numbers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace mocap::calibrate {

const YamlValue* YamlCamera::require(std::initializer_list<const char*> keys, const char* expected) {
  const YamlValue* found = table_.find(keys);
  if (found == nullptr) complain(table_, fmt::format("has no {}, expected {}", *keys.begin(), expected));
  return found;
}

bool YamlCamera::gather(const YamlValue& value, std::vector<double>& into, const char* key) {
  if (value.kind == YamlValue::Kind::List) {
    return std::ranges::all_of(value.list, [&](const YamlValue& item) { return gather(item, into, key); });
  }
  if (value.kind == YamlValue::Kind::Table) {
    if (const YamlValue* data = value.find({"data"})) return gather(*data, into, key);
  }
  const auto number = value.kind == YamlValue::Kind::Word ? number_of(value.word) : std::nullopt;
  if (!number) {
    complain(value, fmt::format("{} has '{}', expected finite numbers", key, value.word));
    return false;
  }
  into.push_back(*number);
  return true;
}

std::optional<std::vector<double>> YamlCamera::numbers(const YamlValue& value, const char* key,
                                                       std::initializer_list<std::size_t> counts) {
  std::vector<double> found;
  if (!gather(value, found, key)) return std::nullopt;
  if (counts.size() > 0 && std::ranges::find(counts, found.size()) == counts.end()) {
    complain(value, fmt::format("{} has {} numbers, expected {}", key, found.size(), fmt::join(counts, " or ")));
    return std::nullopt;
  }
  return found;
}

void YamlCamera::complain(const YamlValue& at, const std::string& what) {
  complaints_.add(at.at, fmt::format("camera '{}': {}", name_, what));
  sound_ = false;
}

}  // namespace mocap::calibrate
