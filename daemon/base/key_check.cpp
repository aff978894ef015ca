#include "base/key_check.h"

#include <fmt/format.h>

namespace mocap {

void KeyCheck::expect_within(const Key& key, double value) {
  if (is_within(value, key.range)) return;
  faults_.push_back(
      {std::string(key.name), fmt::format("{} is {}, expected {}", key.name, value, range_text(key.range))});
}

void KeyCheck::visit(const Key& /*key*/, bool& /*field*/) {}

void KeyCheck::visit(const Key& key, std::optional<double>& value) {
  if (value) expect_within(key, *value);
}

void KeyCheck::visit(const Key& key, std::optional<std::int64_t>& value) {
  if (value) expect_within(key, static_cast<double>(*value));
}

void KeyCheck::visit(const Key& key, std::string& field) {
  if (is_choice(key, field)) return;
  faults_.push_back(
      {std::string(key.name), fmt::format("{} is '{}', expected {}", key.name, field, choices_text(key))});
}

void KeyCheck::visit(const Key& /*key*/, std::filesystem::path& /*field*/) {}

void KeyCheck::visit(const Key& key, std::vector<int>& field) {
  for (const int value : field) expect_within(key, value);
}

void KeyCheck::visit(const Key& /*key*/, std::vector<std::string>& /*field*/) {}

void KeyCheck::visit(const Key& key, std::span<double> fields) {
  for (const double value : fields) expect_within(key, value);
}

void KeyCheck::visit(const Key& /*key*/, KeyPairs& /*field*/) {}

}  // namespace mocap
