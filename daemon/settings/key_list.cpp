#include "settings/key_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace mocap::settings {

ListedKey& KeyList::add(const Key& key, std::string value) {
  return entries_.emplace_back(ListedKey{.key = key, .value = std::move(value), .note = std::exchange(note_, {})});
}

void KeyList::visit(const Key& key, bool& field) { add(key, field ? "true" : "false"); }

void KeyList::visit(const Key& key, std::optional<double>& value) {
  // Twelve digits hide the rounding of a unit conversion.
  add(key, value ? fmt::format("{:.12g}", *value) : "").has_default = value.has_value();
}

void KeyList::visit(const Key& key, std::optional<std::int64_t>& value) {
  add(key, value ? std::to_string(*value) : "").has_default = value.has_value();
}

void KeyList::visit(const Key& key, std::string& field) {
  ListedKey& listed = add(key, fmt::format("\"{}\"", field));
  listed.is_text = true;
  listed.has_default = !field.empty();
}

void KeyList::visit(const Key& key, std::filesystem::path& field) {
  std::string text = field.string();
  visit(key, text);
}

void KeyList::visit(const Key& key, std::vector<int>& field) {
  add(key, fmt::format("[{}]", fmt::join(field, ", "))).is_list = true;
}

void KeyList::visit(const Key& key, std::vector<std::string>& field) {
  add(key, field.empty() ? "[]" : fmt::format("[\"{}\"]", fmt::join(field, "\", \"")));
}

void KeyList::visit(const Key& key, std::span<double> fields) {
  add(key, fmt::format("[{}]", fmt::join(fields, ", "))).is_list = true;
}

void KeyList::visit(const Key& key, KeyPairs& field) {
  std::string text;
  for (const auto& [name, value] : field) text += fmt::format("{}{} = \"{}\"", text.empty() ? "" : ", ", name, value);
  add(key, text.empty() ? "{}" : fmt::format("{{ {} }}", text)).has_default = !field.empty();
}

}  // namespace mocap::settings
