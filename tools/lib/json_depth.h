#pragma once

#include <cstddef>
#include <string_view>

namespace mocap {

inline constexpr int kMaxJsonDepth = 32;

/// Whether the JSON of an untrusted file or peer is nested deeper than kMaxJsonDepth: the JSON library parses such a
/// text, but recurses into nested values to copy or write them.
inline bool is_deep(std::string_view json) {
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size() && depth <= kMaxJsonDepth; ++i) {
    const char c = json[i];
    if (c == '"') in_string = !in_string;
    if (in_string && c == '\\') ++i;  // the next character ends no string
    if (in_string) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
  }
  return depth > kMaxJsonDepth;
}

}  // namespace mocap
