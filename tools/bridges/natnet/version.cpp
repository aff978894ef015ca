#include "bridges/natnet/version.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

namespace mocap::natnet {

Version nearest(Version wanted) {
  constexpr std::array<Version, 4> kServed{Version{4, 1}, Version{4, 0}, Version{3, 1}, Version{3, 0}};
  const auto* const found = std::find_if(kServed.begin(), kServed.end(), [&](Version one) { return one <= wanted; });
  return found == kServed.end() ? kOldest : *found;
}

std::optional<Version> read_version(std::string_view text) {
  Version read{};
  const char* const end = text.data() + text.size();
  const auto major = std::from_chars(text.data(), end, read.major);
  if (major.ec != std::errc() || major.ptr == end || *major.ptr != '.') return std::nullopt;
  const auto minor = std::from_chars(major.ptr + 1, end, read.minor);
  if (minor.ec != std::errc() || (minor.ptr != end && *minor.ptr != '.')) return std::nullopt;
  return read;
}

std::string to_string(Version version) { return fmt::format("{}.{}", version.major, version.minor); }

}  // namespace mocap::natnet
