#include "take/take_name.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <string_view>

#include "base/list_folder.h"

namespace mocap::take {
namespace {

constexpr std::size_t kLongestName = 100;
constexpr std::string_view kNumber = "{number}";
constexpr std::string_view kPlaceholders[] = {"{slate}", kNumber, "{date}", "{time}"};

Error wrong(std::string what) { return {ErrorCode::InvalidArgument, std::move(what)}; }

std::string replaced(std::string text, std::string_view placeholder, const std::string& by) {
  for (std::size_t at = text.find(placeholder); at != std::string::npos; at = text.find(placeholder, at + by.size())) {
    text.replace(at, placeholder.size(), by);
  }
  return text;
}

// The number between prefix and suffix of a file's stem; 0: the stem is another one.
std::uint32_t number_of(std::string_view stem, std::string_view prefix, std::string_view suffix) {
  if (stem.size() <= prefix.size() + suffix.size() || !stem.starts_with(prefix) || !stem.ends_with(suffix)) return 0;
  const std::string_view digits = stem.substr(prefix.size(), stem.size() - prefix.size() - suffix.size());
  std::uint32_t number = 0;
  const auto [end, fault] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return fault == std::errc{} && end == digits.data() + digits.size() ? number : 0;
}

}  // namespace

Status check_name(const std::string& name, const char* what) {
  const bool plain = std::ranges::none_of(
      name, [](char c) { return c == '/' || c == '\\' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (name.empty() || name.size() > kLongestName || !plain || name.front() == '.' || name.front() == '-') {
    return wrong(
        fmt::format("{} is '{}', expected 1 to {} bytes without '/', '\\' and control characters, and not '.' "
                    "or '-' first",
                    what, name, kLongestName));
  }
  return {};
}

Status check_pattern(const std::string& pattern) {
  std::string rest = pattern;
  for (const std::string_view placeholder : kPlaceholders) rest = replaced(rest, placeholder, "x");
  if (rest.find_first_of("{}") != std::string::npos) {
    return wrong(
        fmt::format("name is '{}', expected only {{slate}}, {{number}}, {{date}} and {{time}} in braces", pattern));
  }
  const std::size_t number = pattern.find(kNumber);
  if (number == std::string::npos || pattern.find(kNumber, number + 1) != std::string::npos) {
    return wrong(
        fmt::format("name is '{}', expected {{number}} once, so that no take has the name of another", pattern));
  }
  return check_name(rest, "name");
}

TakeName next_name(const std::filesystem::path& folder, const std::string& pattern, const std::string& slate,
                   Duration utc) {
  const auto seconds = static_cast<std::time_t>(std::chrono::floor<std::chrono::seconds>(utc).count());
  const std::tm when = fmt::gmtime(seconds);
  std::string name = replaced(pattern, "{date}", fmt::format("{:%Y-%m-%d}", when));
  name = replaced(name, "{time}", fmt::format("{:%H%M%S}", when));
  const std::size_t at = name.find(kNumber);
  const std::string prefix = replaced(name.substr(0, at), "{slate}", slate);
  const std::string suffix = replaced(name.substr(at + kNumber.size()), "{slate}", slate);
  std::uint32_t largest = 0;
  for (const std::filesystem::path& file : list_folder(folder).paths) {  // a missing folder has no takes
    if (file.extension() == ".mcap") largest = std::max(largest, number_of(file.stem().string(), prefix, suffix));
  }
  return {fmt::format("{}{:03}{}", prefix, largest + 1, suffix), largest + 1};
}

bool has_take(const std::filesystem::path& folder, const std::string& name) {
  std::error_code none;
  return std::filesystem::exists(std::filesystem::symlink_status(folder / (name + ".mcap"), none));
}

std::string free_name(const std::filesystem::path& folder, const std::string& name) {
  for (std::uint32_t number = 2;; ++number) {
    std::string next = fmt::format("{}-{}", name, number);
    if (!has_take(folder, next)) return next;
  }
}

}  // namespace mocap::take
