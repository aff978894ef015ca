#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

/// Functions on a row of a bit image: one bit for each pixel, 64 pixels in a word. `row` points to the word of x = 0 to
/// 63.
namespace mocap::detect {

/// The bits of the pixels from x up to `end` (exclusive, greater than x), as far as they lie in the word of x.
inline std::uint64_t bits_between(int x, int end) {
  const int first = x & 63, last = std::min(64, first + end - x);
  return ~0ULL >> (64 - (last - first)) << first;
}

/// The first bright pixel in [begin, end), or `end` if there is none.
inline int first_bright(const std::uint64_t* row, int begin, int end) {
  for (int x = begin; x < end; x = (x | 63) + 1) {
    const std::uint64_t bits = row[x >> 6] & bits_between(x, end);
    if (bits != 0) return (x & ~63) + std::countr_zero(bits);
  }
  return end;
}

inline bool any_bright(const std::uint64_t* row, int begin, int end) { return first_bright(row, begin, end) < end; }

}  // namespace mocap::detect
