#include "base/key_visitor.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numbers>

#include "base/expects.h"

namespace mocap {
namespace {

// A choice that ends so stands for all words that end in a whole number instead.
constexpr std::string_view kAnyNumber = "<n>";

double unit_s_of(std::string_view name) {
  if (name.ends_with("_us")) return 1e-6;
  if (name.ends_with("_ms")) return 1e-3;
  MOCAP_EXPECTS(name.ends_with("_s"));
  return 1.0;
}

bool matches(std::string_view choice, std::string_view word) {
  if (!choice.ends_with(kAnyNumber)) return word == choice;
  const std::string_view begin = choice.substr(0, choice.size() - kAnyNumber.size());
  if (!word.starts_with(begin) || word.size() == begin.size()) return false;
  return std::ranges::all_of(word.substr(begin.size()), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

void KeyVisitor::time(std::string_view name, Duration& field, KeyRange range, const KeyDoc& doc) {
  const double unit_s = unit_s_of(name);
  // Nanoseconds are divided by whole nanoseconds, so that 500 us is 500 and not 499.99999.
  std::optional<double> value = static_cast<double>(field.count()) / (unit_s * 1e9);
  visit(Key{name, doc, range}, value);
  field = from_s(*value * unit_s);
}

void KeyVisitor::degrees(std::string_view name, double& field_rad, KeyRange range_degrees, const KeyDoc& doc) {
  const double before = field_rad * 180.0 / std::numbers::pi;
  std::optional<double> value = before;
  visit(Key{name, doc, range_degrees}, value);
  if (*value != before) field_rad = *value * std::numbers::pi / 180.0;
}

void KeyVisitor::millimetres(std::string_view name, double& field_m, KeyRange range_mm, const KeyDoc& doc) {
  const double before = field_m * 1e3;
  std::optional<double> value = before;
  visit(Key{name, doc, range_mm}, value);
  if (*value != before) field_m = *value * 1e-3;
}

bool is_within(double value, KeyRange range) { return value >= range.min && value <= range.max; }

bool is_choice(const Key& key, std::string_view word) {
  return key.choices.empty() ||
         std::ranges::any_of(key.choices, [&](std::string_view choice) { return matches(choice, word); });
}

std::string range_text(KeyRange range) { return fmt::format("{} to {}", range.min, range.max); }

std::string choices_text(const Key& key) { return fmt::format("one of {}", fmt::join(key.choices, ", ")); }

}  // namespace mocap
