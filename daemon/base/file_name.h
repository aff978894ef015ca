#pragma once

#include <algorithm>
#include <string_view>

namespace mocap {

/// Whether a name from outside can be part of the name of a file that is written: at most 64 ASCII letters, digits,
/// underscores, hyphens, dots and spaces, the first a letter, a digit or an underscore. Such a name leads to no other
/// folder and hides no file.
inline bool is_file_name(std::string_view name) {
  const auto is_word = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  };
  return !name.empty() && name.size() <= 64 && is_word(name.front()) &&
         std::ranges::all_of(name, [&](char c) { return is_word(c) || c == '-' || c == '.' || c == ' '; });
}

}  // namespace mocap
