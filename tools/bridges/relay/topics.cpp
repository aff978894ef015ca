#include "bridges/relay/topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace mocap::relay {
namespace {

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}

}  // namespace

bool is_subject_prefix(std::string_view text) {
  const bool characters = std::ranges::all_of(text, [](char c) { return is_plain(c) || c == '.'; });
  return characters && !text.empty() && text.front() != '.' && text.back() != '.' &&
         text.find("..") == std::string_view::npos;
}

bool is_topic(std::string_view topic) {
  constexpr std::array kWhole{"description", "snapshot", "health", "event", "markers"};
  constexpr std::array kKinds{"lite/", "subject/", "preview/"};
  return std::ranges::any_of(kWhole, [&](std::string_view one) { return topic == one; }) ||
         std::ranges::any_of(kKinds, [&](std::string_view one) { return topic.starts_with(one) && topic != one; });
}

std::string subject_of(std::string_view prefix, std::string_view topic) {
  std::string subject = fmt::format("mocap.{}.", prefix);
  const std::size_t slash = topic.find('/');
  subject += topic.substr(0, slash);
  if (slash == std::string_view::npos) return subject;
  subject += '.';
  for (const char c : topic.substr(slash + 1)) {
    if (is_plain(c)) {
      subject += c;
    } else {
      subject += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return subject;
}

}  // namespace mocap::relay
