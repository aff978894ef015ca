#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::client {

/// Copies a text of UTF-8 and a zero byte into a buffer of the caller; cuts a longer text before an incomplete
/// character. Does nothing without a buffer.
inline void copy_text(char* into, std::size_t size, std::string_view text) {
  if (into == nullptr || size == 0) return;
  std::size_t length = std::min(size - 1, text.size());
  if (length < text.size()) {
    while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0) == 0x80) --length;
  }
  if (length > 0) std::memcpy(into, text.data(), length);
  into[length] = '\0';
}

/// A text of the C ABI; NULL is empty.
inline std::string text_of(const char* text) { return text == nullptr ? "" : text; }

/// Copies a struct of the C ABI, at most `size` bytes: its size in the caller's version of the header.
template <typename Struct>
void fill(Struct* into, std::size_t size, const Struct& from) {
  std::memcpy(into, &from, std::min(size, sizeof(Struct)));
}

/// A message about a name that does not exist: the nearest name as a suggestion, and all that exist. `kind` is the
/// noun, such as "bone"; `owner` has the names.
std::string unknown_name(std::string_view kind, std::string_view name, std::string_view owner,
                         const std::vector<std::string>& known);

}  // namespace mocap::client
