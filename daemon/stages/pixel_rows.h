#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace mocap::stages {

// How to read a row of luminance. Each layout gives the value of one pixel, and a mask that tells which of 16
// neighbours are at a threshold or over it (bit i: pixel i): most blocks of a marker image are dark and are passed over
// by one comparison. A mask reads exactly the bytes of its 16 pixels.

inline constexpr int kBlock_px = 16;

/// One byte a pixel: Mono8, and the luminance plane of Nv12.
struct BytePixels {
  static constexpr std::size_t kBytesPerPixel = 1;

  static std::uint32_t value(const std::byte* row, int x) { return std::to_integer<std::uint32_t>(row[x]); }

  static std::uint32_t mask(const std::byte* row, int x, std::uint32_t threshold) {
#if defined(__SSE2__)
    const __m128i pixels = _mm_loadu_si128(reinterpret_cast<const __m128i*>(row + x));
    const __m128i level = _mm_set1_epi8(static_cast<char>(threshold));
    return static_cast<std::uint32_t>(_mm_movemask_epi8(_mm_cmpeq_epi8(_mm_max_epu8(pixels, level), pixels)));
#else
    std::uint32_t bits = 0;
    for (int i = 0; i < kBlock_px; ++i) bits |= static_cast<std::uint32_t>(value(row, x + i) >= threshold) << i;
    return bits;
#endif
  }
};

/// Two bytes a pixel, of which `kKept` bits count: Mono10 and Mono12 (all), Yuyv (the first byte).
template <std::uint16_t kKept>
struct WordPixels {
  static constexpr std::size_t kBytesPerPixel = 2;

  static std::uint32_t value(const std::byte* row, int x) {
    const std::byte* at = row + 2 * static_cast<std::ptrdiff_t>(x);
    const auto low = std::to_integer<std::uint32_t>(at[0]);
    return (low | std::to_integer<std::uint32_t>(at[1]) << 8U) & kKept;
  }

  static std::uint32_t mask(const std::byte* row, int x, std::uint32_t threshold) {
#if defined(__SSE2__)
    const auto dark = [threshold](const std::byte* at) {
      const __m128i kept = _mm_set1_epi16(static_cast<short>(kKept));
      const __m128i below = _mm_set1_epi16(static_cast<short>(threshold - 1));
      const __m128i words = _mm_and_si128(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)), kept);
      return _mm_cmpeq_epi16(_mm_subs_epu16(words, below), _mm_setzero_si128());
    };
    const std::byte* at = row + 2 * static_cast<std::ptrdiff_t>(x);
    const __m128i dark16 = _mm_packs_epi16(dark(at), dark(at + 16));
    return ~static_cast<std::uint32_t>(_mm_movemask_epi8(dark16)) & 0xFFFFU;
#else
    std::uint32_t bits = 0;
    for (int i = 0; i < kBlock_px; ++i) bits |= static_cast<std::uint32_t>(value(row, x + i) >= threshold) << i;
    return bits;
#endif
  }
};

using DeepPixels = WordPixels<0xFFFF>;
using YuyvPixels = WordPixels<0x00FF>;

/// Calls `run(begin, end)` for each stretch of pixels at `threshold` (at least 1) or over it, from left to right.
template <class Pixels, class OnRun>
void for_each_run(const std::byte* row, int width_px, std::uint32_t threshold, OnRun&& run) {
  int begin = -1;  // of the run that is open
  int x = 0;
  for (; x + kBlock_px <= width_px; x += kBlock_px) {
    const std::uint32_t bright = Pixels::mask(row, x, threshold);
    if (bright == (begin < 0 ? 0U : 0xFFFFU)) continue;  // all dark and no run open, or all bright within one
    int at = 0;
    while (at < kBlock_px) {
      const std::uint32_t changed = (begin < 0 ? bright : ~bright & 0xFFFFU) >> at;
      if (changed == 0) break;
      at += std::countr_zero(changed);
      if (begin < 0) {
        begin = x + at;
      } else {
        run(begin, x + at);
        begin = -1;
      }
    }
  }
  for (; x < width_px; ++x) {
    const bool bright = Pixels::value(row, x) >= threshold;
    if (bright && begin < 0) begin = x;
    if (!bright && begin >= 0) {
      run(begin, x);
      begin = -1;
    }
  }
  if (begin >= 0) run(begin, width_px);
}

}  // namespace mocap::stages
