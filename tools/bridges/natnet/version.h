#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace mocap::natnet {

/// A version of the bitstream.
struct Version {
  std::uint8_t major = 3;
  std::uint8_t minor = 1;

  auto operator<=>(const Version&) const = default;
};

constexpr Version kOldest{3, 0};
constexpr Version kNewest{4, 1};

/// The version that is served to a client that asks for `wanted`: the nearest of 3.0, 3.1, 4.0 and 4.1 that is not
/// newer; 3.0 for older ones.
Version nearest(Version wanted);

/// Reads "3.1" or "4.1.0.0"; empty if `text` is no version.
std::optional<Version> read_version(std::string_view text);
std::string to_string(Version version);

}  // namespace mocap::natnet
