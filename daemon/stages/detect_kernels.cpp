#include "stages/detect_kernels.h"

#include <algorithm>
#include <cstring>

#include "stages/detect_kernels_scalar.h"
#include "stages/detect_row.h"

// This file is compiled once for each target. SSE4 is x86-64-v2, AVX2 v3, AVX3 v4; what lies between them gains
// nothing.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "stages/detect_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace mocap::stages::HWY_NAMESPACE {
namespace {

#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128

namespace hn = hwy::HWY_NAMESPACE;

// How far ahead of the reading the memory is asked for: the processor's own prefetch stops at the end of each page.
constexpr std::size_t kAhead_bytes = 2048;

/// Reads pixels of one byte.
struct BytePixels {
  using D = hn::CappedTag<std::uint8_t, 64>;
  using V = hn::Vec<D>;
  static constexpr std::size_t kBytes = 1;

  V threshold;
  explicit BytePixels(const ScanRows& rows) : threshold(hn::Set(D(), static_cast<std::uint8_t>(rows.threshold))) {}

  // v >= threshold; unsigned vectors have no such comparison.
  HWY_INLINE hn::Mask<D> bright(V v) const { return hn::Eq(hn::Max(v, threshold), v); }
  HWY_INLINE V load(const std::byte* at) const { return hn::LoadU(D(), reinterpret_cast<const std::uint8_t*>(at)); }
};

/// Reads pixels of two bytes.
struct WordPixels {
  using D = hn::CappedTag<std::uint16_t, 64>;
  using V = hn::Vec<D>;
  static constexpr std::size_t kBytes = 2;

  V threshold, kept;
  explicit WordPixels(const ScanRows& rows)
      : threshold(hn::Set(D(), static_cast<std::uint16_t>(rows.threshold))), kept(hn::Set(D(), rows.kept)) {}

  // v >= threshold; unsigned vectors have no such comparison.
  HWY_INLINE hn::Mask<D> bright(V v) const { return hn::Eq(hn::Max(v, threshold), v); }
  HWY_INLINE V load(const std::byte* at) const {
    return hn::And(hn::LoadU(D(), reinterpret_cast<const std::uint16_t*>(at)), kept);
  }
};

/// 64 pixels, one bit each.
template <class Pixels>
HWY_INLINE std::uint64_t bright_bits(const Pixels& pixels, const std::byte* at) {
  const typename Pixels::D d;
  constexpr std::size_t kLanes = hn::MaxLanes(typename Pixels::D());
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 64; i += kLanes) {
    const auto mask = pixels.bright(pixels.load(at + i * Pixels::kBytes));
    std::uint8_t packed[8] = {};
    hn::StoreMaskBits(d, mask, packed);
    std::uint64_t part = 0;
    std::memcpy(&part, packed, sizeof(part));
    bits |= part << i;
  }
  return bits;
}

/// Whether any of `kCount` x 64 pixels is bright.
template <int kCount, class Pixels>
HWY_INLINE bool any_bright(const Pixels& pixels, const std::byte* at) {
  const typename Pixels::D d;
  constexpr std::size_t kLanes = hn::MaxLanes(typename Pixels::D());
  auto greatest = pixels.load(at);
  for (std::size_t i = kLanes; i < kCount * 64; i += kLanes) {
    greatest = hn::Max(greatest, pixels.load(at + i * Pixels::kBytes));
  }
  return !hn::AllFalse(d, pixels.bright(greatest));
}

template <class Pixels>
void scan(const ScanRows& rows, RunSink& sink) {
  constexpr std::size_t kWordBytes = 64 * Pixels::kBytes;
  constexpr int kGroup = 4;  // words that are looked at together while all is dark
  const Pixels pixels(rows);
  const int words = rows.width_px / 64;
  const int rest = rows.width_px % 64;
  BrightWords found;
  for (int y = 0; y < rows.rows; ++y) {
    const std::byte* row = rows.bytes + static_cast<std::size_t>(y) * rows.stride_bytes;
    int word = 0;
    for (; word + kGroup <= words; word += kGroup) {
      const std::byte* at = row + static_cast<std::size_t>(word) * kWordBytes;
      for (std::size_t line = 0; line < kGroup * kWordBytes; line += 64) {
        __builtin_prefetch(at + kAhead_bytes + line);
      }
      if (!any_bright<kGroup>(pixels, at)) continue;
      for (int i = 0; i < kGroup; ++i) {
        const std::uint64_t bits = bright_bits(pixels, at + static_cast<std::size_t>(i) * kWordBytes);
        if (bits != 0) found.add((word + i) * 64, bits);
      }
    }
    for (; word < words; ++word) {
      const std::uint64_t bits = bright_bits(pixels, row + static_cast<std::size_t>(word) * kWordBytes);
      if (bits != 0) found.add(word * 64, bits);
    }
    if (rest != 0) {
      // The last pixels lie at the end of a word that begins within the row.
      const std::size_t begin = static_cast<std::size_t>(rows.width_px - 64) * Pixels::kBytes;
      const std::uint64_t bits = bright_bits(pixels, row + begin) >> (64 - rest);
      if (bits != 0) found.add(words * 64, bits);
    }
    if (!found.empty()) found.flush(rows.first_y + y, sink);
  }
}

template <class Pixels>
void scan_rows(const ScanRows& rows, RunSink& sink) {
  if (rows.width_px >= 64) return scan<Pixels>(rows, sink);
  const DetectKernels& scalar = scalar_kernels();
  (Pixels::kBytes == 1 ? scalar.scan_bytes : scalar.scan_words)(rows, sink);
}

// The loops below are plain: the compiler knows this target's vectors here.

void widen(const ByteWindow& window, const Box& box, std::uint16_t* pixels) {
  for (int row = 0; row < box.height_px; ++row) {
    const std::byte* from = window.bytes + static_cast<std::size_t>(row) * window.stride_bytes;
    for (int begin = 0; begin < box.width_px; begin += kBoxStep_px) {
      const int n = window.width_px - begin;
      for (int i = 0; i < kBoxStep_px; ++i) {
        const auto grey = std::to_integer<std::uint16_t>(from[begin + i]);
        pixels[i] = i < n ? grey : std::uint16_t{0};
      }
      pixels += kBoxStep_px;
    }
  }
}

BoxSurvey survey(const Box& box, std::uint32_t threshold, std::uint32_t top) {
  std::uint32_t peak = 0, bright = 0, at_top = 0;
  const int n = box.width_px * box.height_px;
  for (int begin = 0; begin < n; begin += kBoxStep_px) {
    const std::uint16_t* pixels = box.pixels + begin;
    for (int i = 0; i < kBoxStep_px; ++i) {
      const std::uint32_t grey = pixels[i];
      peak = std::max(peak, grey);
      bright += grey >= threshold;
      at_top += grey >= top;
    }
  }
  return {peak, bright, at_top};
}

BoxSums weigh(const Box& box, const Weighing& weighing) {
  BoxSums sums;
  const auto low = static_cast<std::int32_t>(weighing.low);
  const auto span = static_cast<std::int32_t>(weighing.span);
  const std::int32_t scale = (kUnit << 16) / span;
  for (int row = 0; row < box.height_px; ++row) {
    const std::uint16_t* pixels = box.pixels + row * box.width_px;
    // Of one row all sums fit: 4096 x 128 x 256 < 2^28 and 4096 x 128^2 x 16 a lane.
    std::int32_t weight_sum = 0, x_sum = 0, slope_sum = 0;
    std::int64_t xx_sum = 0;
    for (int begin = 0; begin < box.width_px; begin += kBoxStep_px) {
      std::int32_t xx_part = 0;
      for (int i = 0; i < kBoxStep_px; ++i) {
        const std::int32_t x = begin + i - box.width_px / 2;
        const std::int32_t over = std::min(std::max(pixels[begin + i] - low, 0), span);
        const std::int32_t u = over * scale >> 16;
        const std::int32_t weight = u * u * (3 * kUnit - 2 * u) >> 18;
        const std::int32_t slope = u * (kUnit - u) >> 12;
        weight_sum += weight;
        x_sum += weight * x;
        slope_sum += slope * slope;
        xx_part += slope * slope * x * x;
      }
      xx_sum += xx_part;
    }
    const std::int64_t y = row - box.height_px / 2;
    sums.weight += weight_sum;
    sums.x += x_sum;
    sums.y += y * weight_sum;
    sums.slope2 += slope_sum;
    sums.xx += xx_sum;
    sums.yy += y * y * slope_sum;
  }
  return sums;
}

#endif

const DetectKernels* kernels() {
#if HWY_TARGET == HWY_AVX3
  static constexpr DetectKernels kKernels{"avx512", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh};
  return &kKernels;
#elif HWY_TARGET == HWY_AVX2
  static constexpr DetectKernels kKernels{"avx2", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh};
  return &kKernels;
#elif HWY_TARGET == HWY_SSE4
  static constexpr DetectKernels kKernels{"sse4", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh};
  return &kKernels;
#elif HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
  return &scalar_kernels();
#else
  static constexpr DetectKernels kKernels{"vector", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh};
  return &kKernels;
#endif
}

}  // namespace
}  // namespace mocap::stages::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mocap::stages {
namespace {

HWY_EXPORT(kernels);

}  // namespace

const DetectKernels& best_kernels() { return *HWY_DYNAMIC_DISPATCH(kernels)(); }

std::vector<const DetectKernels*> all_kernels() {
  std::vector<const DetectKernels*> all{&scalar_kernels()};
  const std::int64_t supported = hwy::SupportedTargets();
  for (const std::int64_t target : {HWY_SSE4, HWY_AVX2, HWY_AVX3}) {
    if ((supported & target & HWY_TARGETS) == 0) continue;
    hwy::GetChosenTarget().Update(target);
    all.push_back(HWY_DYNAMIC_DISPATCH(kernels)());
  }
  hwy::GetChosenTarget().Update(supported);
  return all;
}

}  // namespace mocap::stages
#endif
