#pragma once

#include <string_view>

namespace mocap {

inline constexpr int kMaxJsonDepth = 32;

/// Whether the JSON of an untrusted file or peer is nested deeper than kMaxJsonDepth: the JSON library parses such a
/// text, but recurses into nested values to copy or write them. Brackets within strings count too, which no real text
/// has.
inline bool is_deep(std::string_view json) {
  int depth = 0;
  for (const char c : json) {
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > kMaxJsonDepth) return true;
  }
  return false;
}

}  // namespace mocap
