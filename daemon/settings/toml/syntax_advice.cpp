#include "settings/toml/syntax_advice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>

namespace mocap::settings {
namespace {

std::string_view line_of(std::string_view text, std::uint32_t number) {
  for (std::uint32_t i = 1; i < number; ++i) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  return text.substr(0, text.find('\n'));
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
  return text;
}

struct Quotes {
  std::size_t count = 0;                            // of unescaped double quotes before the comment
  std::size_t comment_at = std::string_view::npos;  // the # outside quotes
};

Quotes quotes_of(std::string_view line) {
  Quotes found;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const bool inside = found.count % 2 == 1;
    if (inside && line[i] == '\\')
      ++i;
    else if (line[i] == '"')
      ++found.count;
    else if (line[i] == '#' && !inside) {
      found.comment_at = i;
      break;
    }
  }
  return found;
}

// A heading such as "[[camera]" whose brackets do not match.
std::optional<std::string> explain_heading(std::string_view line) {
  if (!line.starts_with('[')) return std::nullopt;
  const auto opened = static_cast<std::size_t>(line.find_first_not_of('['));
  const std::size_t closed = static_cast<std::size_t>(std::ranges::count(line, ']'));
  if (opened == std::string_view::npos || opened == closed) return std::nullopt;
  const std::string_view name = line.substr(opened, line.find_first_of("] ", opened) - opened);
  const bool several = name == "camera" || name == "subject" || opened > 1;
  return fmt::format("the brackets of '{}' do not match, expected {}", line,
                     several ? fmt::format("[[{}]]", name) : fmt::format("[{}]", name));
}

// A value such as: name = anna
std::optional<std::string> explain_bare_text(std::string_view line) {
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return std::nullopt;
  const std::string_view key = trimmed(line.substr(0, equals));
  const std::string_view value = trimmed(line.substr(equals + 1));
  if (value.empty()) return fmt::format("{} has no value; write {} = ..., or remove the line", key, key);
  const char first = value.front();
  const bool text = std::isalpha(static_cast<unsigned char>(first)) != 0 || first == '/' || first == '.' ||
                    first == '~' || std::ranges::count(value, '.') > 1 || value.find(':') != std::string_view::npos;
  if (!text || value == "true" || value == "false") return std::nullopt;
  if (value == "True" || value == "False" || value == "yes" || value == "no" || value == "on" || value == "off") {
    return fmt::format("{} is {}, expected true or false", key, value);
  }
  return fmt::format("the value of {} has no quotes; a text needs them: {} = \"{}\"", key, key, value);
}

std::string_view table_in(std::string_view description) {
  const std::size_t begin = description.find('\'');
  const std::size_t end = description.find('\'', begin + 1);
  return end == std::string_view::npos ? std::string_view{} : description.substr(begin + 1, end - begin - 1);
}

}  // namespace

std::string explain_syntax(std::string_view text, std::uint32_t line, std::string_view description) {
  std::string_view bad = line_of(text, line);
  const Quotes quotes = quotes_of(bad);
  if (quotes.count % 2 == 1) {
    return fmt::format("a quote is missing in: {}; a text begins and ends with \" on one line", trimmed(bad));
  }
  bad = trimmed(bad.substr(0, quotes.comment_at));
  if (description.find("redefine") != std::string_view::npos) {
    const std::string_view table = table_in(description);
    if (table == "camera" || table == "subject") {
      return fmt::format("[{0}] is there twice, expected [[{0}]] with two brackets: one such table for each {0}",
                         table);
    }
    return fmt::format("'{}' is there twice, expected once", table);
  }
  if (const auto heading = explain_heading(bad)) return *heading;
  if (quotes.count == 0) {
    if (const auto bare = explain_bare_text(bad)) return *bare;
  }
  if (!bad.empty() && !bad.starts_with('[') && bad.find('=') == std::string_view::npos) {
    return fmt::format(
        "'{}' is neither a heading such as [capture], nor a setting such as name = \"anna\"; comments begin "
        "with #",
        bad);
  }
  return std::string(description);
}

}  // namespace mocap::settings
