#include "stages/detect_kernels.h"

#include <algorithm>
#include <array>
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

constexpr int kGroup = 4;  // words that are looked at together while all is dark

/// The bright pixels of some words of a row, which begin at its first pixel.
template <class Pixels>
HWY_NOINLINE void add_words(const Pixels& pixels, const std::byte* row, int begin, int end, BrightWords& found) {
  for (int word = begin; word < end; ++word) {
    const std::uint64_t bits = bright_bits(pixels, row + static_cast<std::size_t>(word) * 64 * Pixels::kBytes);
    if (bits != 0) found.add(word * 64, bits);
  }
}

/// Finds what is bright in a row, from a word on to its end or to another word.
template <class Pixels>
HWY_INLINE void scan_stretch(const Pixels& pixels, const std::byte* row, int begin, int end, BrightWords& found) {
  // The processor's own prefetch feeds this loop; asking for memory ahead made it a tenth slower.
  for (int word = begin; word + kGroup <= end; word += kGroup) {
    const std::byte* at = row + static_cast<std::size_t>(word) * 64 * Pixels::kBytes;
    if (any_bright<kGroup>(pixels, at)) add_words(pixels, row, word, word + kGroup, found);
  }
}

/// The last pixels of a row, from a word on, which are less than a group and a word.
template <class Pixels>
HWY_INLINE void scan_end(const Pixels& pixels, const std::byte* row, int begin, int width_px, BrightWords& found) {
  // All of it lies in the group, or in the word, that ends where the row does.
  const auto before_end = [&](int pixels_before) {
    return row + static_cast<std::size_t>(width_px - pixels_before) * Pixels::kBytes;
  };
  if (width_px >= kGroup * 64 && !any_bright<kGroup>(pixels, before_end(kGroup * 64))) return;
  const int words = width_px / 64, rest = width_px % 64;
  add_words(pixels, row, begin, words, found);
  const std::uint64_t bits = rest == 0 ? 0 : bright_bits(pixels, before_end(64)) >> (64 - rest);
  if (bits != 0) found.add(words * 64, bits);
}

template <class Pixels>
void scan(const ScanRows& rows, RunSink& sink) {
  // Bands take turns after that many words of a row at most.
  constexpr int kTurn = 1536 / (64 * static_cast<int>(Pixels::kBytes));
  const Pixels pixels(rows);
  const int words = rows.width_px / 64 / kGroup * kGroup;
  const int turns = std::max(1, (words + kTurn - 1) / kTurn);
  const int turn = (words / kGroup + turns - 1) / turns * kGroup;
  const bool has_end = words * 64 < rows.width_px;
  std::array<BrightWords, Bands::kCount> found;
  Bands bands(rows, sink);
  for (int at = 0; at < bands.height(); ++at) {
    for (int i = 0; i < turns; ++i) {
      const int begin = i * turn, end = std::min(words, begin + turn);
      for (int band = 0; band < bands.count(); ++band) {
        const int y = bands.row(band, at);
        if (y < 0) continue;
        const std::byte* row = rows.bytes + static_cast<std::size_t>(y) * rows.stride_bytes;
        BrightWords& of_row = found[static_cast<std::size_t>(band)];
        scan_stretch(pixels, row, begin, end, of_row);
        if (i + 1 < turns) continue;
        if (has_end) scan_end(pixels, row, words, rows.width_px, of_row);
        if (!of_row.empty()) of_row.flush(rows.first_y + y, bands.sink(band));
      }
    }
  }
  bands.gather();
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

template <bool kLinear>
BoxSums weigh(const Box& box, const Weighing& weighing) {
  const D32 d;
  const hn::Rebind<std::uint16_t, D32> d16;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(D32()));
  const auto low = hn::Set(d, static_cast<std::int32_t>(weighing.low));
  const auto span = hn::Set(d, static_cast<std::int32_t>(weighing.span));
  const auto scale = hn::Set(d, (kUnit << 16) / static_cast<std::int32_t>(weighing.span));
  const auto zero = hn::Zero(d), one = hn::Set(d, 1), unit = hn::Set(d, kUnit), three = hn::Set(d, 3 * kUnit);
  Sum64 weight_sum, x_sum, y_sum, slope2_sum, xx_sum, yy_sum;
  for (int begin = 0; begin < box.width_px; begin += kLanes) {
    auto weights = zero, weights_y = zero, slopes2 = zero, slopes2_yy = zero;  // of each column; all fit
    auto y = hn::Set(d, -(box.height_px / 2));
    const std::uint16_t* from = box.pixels + begin;
    for (int row = 0; row < box.height_px; ++row) {
      const auto grey = hn::PromoteTo(d, hn::LoadU(d16, from));
      const auto over = hn::Min(hn::Max(hn::Sub(grey, low), zero), span);
      const auto u = hn::ShiftRight<16>(hn::Mul(over, scale));
      auto weight = hn::ShiftLeft<2>(u);
      auto slope = hn::IfThenElseZero(hn::And(hn::Gt(u, zero), hn::Lt(u, unit)), hn::Set(d, kLinearSlope));
      if constexpr (!kLinear) {
        weight = hn::ShiftRight<18>(hn::Mul(hn::Mul(u, u), hn::Sub(three, hn::Add(u, u))));
        slope = hn::ShiftRight<13>(hn::Add(hn::Mul(u, hn::Sub(unit, u)), hn::Set(d, 4096)));
      }
      const auto slope2 = hn::Mul(slope, slope);
      weights = hn::Add(weights, weight);
      weights_y = hn::Add(weights_y, hn::Mul(weight, y));
      slopes2 = hn::Add(slopes2, slope2);
      slopes2_yy = hn::Add(slopes2_yy, hn::Mul(slope2, hn::Mul(y, y)));
      y = hn::Add(y, one);
      from += box.width_px;
    }
    const auto x = hn::Iota(d, begin - box.width_px / 2);
    weight_sum.add(weights);
    x_sum.add(hn::Mul(weights, x));
    y_sum.add(weights_y);
    slope2_sum.add(slopes2);
    xx_sum.add(hn::Mul(slopes2, hn::Mul(x, x)));
    yy_sum.add(slopes2_yy);
  }
  return {weight_sum.all(), x_sum.all(), y_sum.all(), slope2_sum.all(), xx_sum.all(), yy_sum.all()};
}

#endif

const DetectKernels* kernels() {
#if HWY_TARGET == HWY_AVX3
  static constexpr DetectKernels kKernels{
      "avx512", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh<false>, weigh<true>};
  return &kKernels;
#elif HWY_TARGET == HWY_AVX2
  static constexpr DetectKernels kKernels{
      "avx2", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh<false>, weigh<true>};
  return &kKernels;
#elif HWY_TARGET == HWY_SSE4
  static constexpr DetectKernels kKernels{
      "sse4", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh<false>, weigh<true>};
  return &kKernels;
#elif HWY_TARGET == HWY_SCALAR || HWY_TARGET == HWY_EMU128
  return &scalar_kernels();
#else
  static constexpr DetectKernels kKernels{
      "vector", scan_rows<BytePixels>, scan_rows<WordPixels>, widen, survey, weigh<false>, weigh<true>};
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
