#include "wire/codec/utf8.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace mocap::wire {
namespace {

std::uint8_t byte_at(std::string_view text, std::size_t i) { return static_cast<std::uint8_t>(text[i]); }

bool continues(std::string_view text, std::size_t i) { return i < text.size() && (byte_at(text, i) & 0xC0U) == 0x80U; }

// Returns the length in bytes of the well-formed sequence at `i`, or 0 if there is none. Source: The Unicode Standard,
// table 3-7.
std::size_t sequence_at(std::string_view text, std::size_t i) {
  const std::uint8_t first = byte_at(text, i);
  if (first < 0x80U) return 1;
  const std::uint8_t second = i + 1 < text.size() ? byte_at(text, i + 1) : std::uint8_t{0};
  if (first >= 0xC2U && first <= 0xDFU) return continues(text, i + 1) ? 2 : 0;
  if (first >= 0xE0U && first <= 0xEFU) {
    const bool overlong = first == 0xE0U && second < 0xA0U;
    const bool surrogate = first == 0xEDU && second > 0x9FU;
    return continues(text, i + 1) && continues(text, i + 2) && !overlong && !surrogate ? 3 : 0;
  }
  if (first >= 0xF0U && first <= 0xF4U) {
    const bool overlong = first == 0xF0U && second < 0x90U;
    const bool too_large = first == 0xF4U && second > 0x8FU;
    const bool whole = continues(text, i + 1) && continues(text, i + 2) && continues(text, i + 3);
    return whole && !overlong && !too_large ? 4 : 0;
  }
  return 0;
}

}  // namespace

std::string valid_utf8(std::string_view text) {
  std::string valid;
  assign_valid_utf8(text, valid);
  return valid;
}

void assign_valid_utf8(std::string_view text, std::string& into) {
  into.clear();
  into.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = sequence_at(text, i);
    into.append(length == 0 ? std::string_view("?") : text.substr(i, length));
    i += std::max<std::size_t>(length, 1);
  }
}

}  // namespace mocap::wire
