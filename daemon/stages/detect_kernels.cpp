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
    // The processor's own prefetch feeds this loop; asking for memory ahead made it a tenth slower.
    for (; word + kGroup <= words; word += kGroup) {
      const std::byte* at = row + static_cast<std::size_t>(word) * kWordBytes;
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

using D16 = hn::CappedTag<std::uint16_t, kBoxStep_px>;
using D32 = hn::CappedTag<std::int32_t, kBoxStep_px>;

/// Adds pixels up to a survey.
class Surveying {
 public:
  HWY_INLINE explicit Surveying(const Brightness& levels)
      : threshold_(hn::Set(d_, static_cast<std::uint16_t>(levels.threshold))),
        top_(hn::Set(d_, static_cast<std::uint16_t>(levels.top))),
        peak_(hn::Zero(d_)),
        bright_(hn::Zero(d_)),
        at_top_(hn::Zero(d_)) {}

  HWY_INLINE void add(hn::Vec<D16> grey) {
    peak_ = hn::Max(peak_, grey);
    // A mask is all ones: minus 1. At most 192 x 12 of them come together.
    bright_ = hn::Sub(bright_, hn::VecFromMask(d_, hn::Eq(hn::Max(grey, threshold_), grey)));
    at_top_ = hn::Sub(at_top_, hn::VecFromMask(d_, hn::Eq(hn::Max(grey, top_), grey)));
  }

  BoxSurvey seen() const {
    constexpr std::size_t kLanes = hn::MaxLanes(D16());
    std::uint16_t peak[kLanes], bright[kLanes], at_top[kLanes];
    hn::StoreU(peak_, d_, peak);
    hn::StoreU(bright_, d_, bright);
    hn::StoreU(at_top_, d_, at_top);
    BoxSurvey all;
    for (std::size_t i = 0; i < kLanes; ++i) {
      all.peak = std::max<std::uint32_t>(all.peak, peak[i]);
      all.bright += bright[i];
      all.at_top += at_top[i];
    }
    return all;
  }

 private:
  D16 d_;
  hn::Vec<D16> threshold_, top_;
  hn::Vec<D16> peak_, bright_, at_top_;
};

BoxSurvey widen(const ByteWindow& window, const Box& box, std::uint16_t* pixels, const Brightness& levels) {
  const D16 d;
  const hn::Rebind<std::uint8_t, D16> d8;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(D16()));
  Surveying survey(levels);
  for (int begin = 0; begin < box.width_px; begin += kLanes) {
    const auto inside = hn::FirstN(d, static_cast<std::size_t>(std::clamp(window.width_px - begin, 0, kLanes)));
    const auto* from = reinterpret_cast<const std::uint8_t*>(window.bytes) + begin;
    std::uint16_t* to = pixels + begin;
    for (int row = 0; row < box.height_px; ++row) {
      const auto grey = hn::IfThenElseZero(inside, hn::PromoteTo(d, hn::LoadU(d8, from)));
      hn::StoreU(grey, d, to);
      survey.add(grey);
      from += window.stride_bytes;
      to += box.width_px;
    }
  }
  return survey.seen();
}

BoxSurvey survey(const Box& box, const Brightness& levels) {
  const D16 d;
  const int pixels = box.width_px * box.height_px;
  Surveying survey(levels);
  for (int i = 0; i < pixels; i += static_cast<int>(hn::MaxLanes(D16()))) survey.add(hn::LoadU(d, box.pixels + i));
  return survey.seen();
}

/// Adds up lanes of 32 bits in 64.
class Sum64 {
 public:
  HWY_INLINE Sum64() : sum_(hn::Zero(d64_)) {}
  HWY_INLINE void add(hn::Vec<D32> v) {
    sum_ = hn::Add(sum_,
                   hn::Add(hn::PromoteTo(d64_, hn::LowerHalf(half_, v)), hn::PromoteTo(d64_, hn::UpperHalf(half_, v))));
  }
  std::int64_t all() const { return hn::GetLane(hn::SumOfLanes(d64_, sum_)); }

 private:
  hn::Half<D32> half_;
  hn::Rebind<std::int64_t, hn::Half<D32>> d64_;
  hn::Vec<hn::Rebind<std::int64_t, hn::Half<D32>>> sum_;
};

/// Sums of one power of u, of a few columns.
struct PowerSums {
  hn::Vec<D32> weights, above;  // `above` adds up `weights` row after row: it tells y without a product

  HWY_INLINE PowerSums() : weights(hn::Zero(D32())), above(hn::Zero(D32())) {}
  HWY_INLINE void add(hn::Vec<D32> weight) {
    weights = hn::Add(weights, weight);
    above = hn::Add(above, weights);
  }
};

BoxSums weigh(const Box& box, const Weighing& weighing) {
  const D32 d;
  const hn::Rebind<std::uint16_t, D32> d16;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(D32()));
  const auto low = hn::Set(d, static_cast<std::int32_t>(weighing.low));
  const auto span = hn::Set(d, static_cast<std::int32_t>(weighing.span));
  const auto scale = hn::Set(d, (kUnit << 16) / static_cast<std::int32_t>(weighing.span));
  const auto zero = hn::Zero(d), half_step = hn::Set(d, 16);
  Sum64 weight_sums[kPowers], x_sums[kPowers], above_sums[kPowers], slope2_sum, xx_sum, yy_sum;
  for (int begin = 0; begin < box.width_px; begin += kLanes) {
    PowerSums first, second, third;          // of each column; all fit
    auto slopes2 = zero, slopes2_yy = zero;  // likewise
    std::int32_t y = -(box.height_px / 2);
    const std::uint16_t* from = box.pixels + begin;
    for (int row = 0; row < box.height_px; ++row) {
      const auto grey = hn::PromoteTo(d, hn::LoadU(d16, from));
      const auto over = hn::Min(hn::Max(hn::Sub(grey, low), zero), span);
      const auto u = hn::ShiftRight<16>(hn::Mul(over, scale));
      const auto u1 = hn::ShiftLeft<2>(u);
      const auto u2 = hn::ShiftRight<8>(hn::Mul(u, u));
      const auto slope = hn::ShiftRight<5>(hn::Add(hn::Sub(u1, u2), half_step));
      const auto slope2 = hn::Mul(slope, slope);
      first.add(u1);
      second.add(u2);
      third.add(hn::ShiftRight<10>(hn::Mul(u, u2)));
      slopes2 = hn::Add(slopes2, slope2);
      slopes2_yy = hn::Add(slopes2_yy, hn::Mul(slope2, hn::Set(d, y * y)));
      ++y;
      from += box.width_px;
    }
    const auto x = hn::Iota(d, begin - box.width_px / 2);
    const PowerSums* const powers[kPowers] = {&first, &second, &third};
    for (int i = 0; i < kPowers; ++i) {
      weight_sums[i].add(powers[i]->weights);
      x_sums[i].add(hn::Mul(powers[i]->weights, x));
      above_sums[i].add(powers[i]->above);
    }
    slope2_sum.add(slopes2);
    xx_sum.add(hn::Mul(slopes2, hn::Mul(x, x)));
    yy_sum.add(slopes2_yy);
  }
  BoxSums sums;
  for (int i = 0; i < kPowers; ++i) {
    sums.weight[i] = weight_sums[i].all();
    sums.x[i] = x_sums[i].all();
    sums.y[i] = (box.height_px - box.height_px / 2) * sums.weight[i] - above_sums[i].all();
  }
  sums.slope2 = slope2_sum.all();
  sums.xx = xx_sum.all();
  sums.yy = yy_sum.all();
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
