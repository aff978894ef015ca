#include "settings/key_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace mocap::settings {

void KeyList::add(const Key& key, std::string value) { entries_.emplace_back(std::string(key.name), std::move(value)); }

void KeyList::visit(const Key& key, bool& field) { add(key, field ? "true" : "false"); }

void KeyList::visit(const Key& key, std::optional<double>& value) {
  // Twelve digits hide the rounding of a unit conversion.
  add(key, value ? fmt::format("{:.12g}", *value) : "");
}

void KeyList::visit(const Key& key, std::optional<std::int64_t>& value) {
  add(key, value ? std::to_string(*value) : "");
}

void KeyList::visit(const Key& key, std::string& field) { add(key, fmt::format("\"{}\"", field)); }

void KeyList::visit(const Key& key, std::filesystem::path& field) { add(key, fmt::format("\"{}\"", field.string())); }

void KeyList::visit(const Key& key, std::vector<int>& field) { add(key, fmt::format("[{}]", fmt::join(field, ", "))); }

void KeyList::visit(const Key& key, std::vector<std::string>& field) {
  add(key, field.empty() ? "" : fmt::format("[\"{}\"]", fmt::join(field, "\", \"")));
}

void KeyList::visit(const Key& key, std::span<double> fields) {
  add(key, fmt::format("[{}]", fmt::join(fields, ", ")));
}

void KeyList::visit(const Key& key, KeyPairs& field) {
  std::string text;
  for (const auto& [name, value] : field) text += fmt::format("{}{} = \"{}\"", text.empty() ? "" : ", ", name, value);
  add(key, text.empty() ? "{}" : fmt::format("{{ {} }}", text));
}

}  // namespace mocap::settings
