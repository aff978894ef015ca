#include "settings/key_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace mocap::settings {

void KeyList::add(std::string_view key, std::string value) {
  entries_.emplace_back(std::string(key), std::move(value));
}

void KeyList::flag(std::string_view key, bool& field) { add(key, field ? "true" : "false"); }

void KeyList::text(std::string_view key, std::string& field) { add(key, fmt::format("\"{}\"", field)); }

void KeyList::path(std::string_view key, std::filesystem::path& field) {
  add(key, fmt::format("\"{}\"", field.string()));
}

void KeyList::one_of(std::string_view key, std::string& field, const std::vector<std::string>& /*words*/) {
  add(key, fmt::format("\"{}\"", field));
}

void KeyList::whole_numbers(std::string_view key, std::vector<int>& field, Range /*range*/) {
  add(key, fmt::format("[{}]", fmt::join(field, ", ")));
}

void KeyList::texts(std::string_view key, std::vector<std::string>& field) {
  add(key, field.empty() ? "" : fmt::format("[\"{}\"]", fmt::join(field, "\", \"")));
}

void KeyList::numbers(std::string_view key, double* fields, std::size_t count, Range /*range*/) {
  add(key, fmt::format("[{}]", fmt::join(fields, fields + count, ", ")));
}

void KeyList::pairs(std::string_view key, std::vector<std::pair<std::string, std::string>>& field) {
  std::string text;
  for (const auto& [name, value] : field) text += fmt::format("{}{} = \"{}\"", text.empty() ? "" : ", ", name, value);
  add(key, text.empty() ? "{}" : fmt::format("{{ {} }}", text));
}

void KeyList::real(std::string_view key, std::optional<double>& value, Range /*range*/) {
  // Twelve digits: what a unit conversion leaves in the last ones is nobody's setting.
  add(key, value ? fmt::format("{:.12g}", *value) : "");
}

void KeyList::whole(std::string_view key, std::optional<std::int64_t>& value, Range /*range*/) {
  add(key, value ? std::to_string(*value) : "");
}

}  // namespace mocap::settings
