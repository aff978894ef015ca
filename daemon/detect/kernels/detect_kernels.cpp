#include "detect/kernels/detect_kernels.h"

#include <algorithm>
#include <cstring>

#include "detect/kernels/scalar_kernels.h"

// This file is compiled once for each target: SSE4 is x86-64-v2, AVX2 is v3, AVX3 is v4. The targets between them are
// not faster.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "detect/kernels/detect_kernels.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace mocap::detect::HWY_NAMESPACE {
namespace {

#if HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128

namespace hn = hwy::HWY_NAMESPACE;

/// Compares pixels with the threshold. Unsigned vectors have no comparison: with the highest bit flipped, the signed
/// comparison has the same result.
template <class D, class S = hn::RebindToSigned<D>>
struct Brightness {
  hn::Vec<D> flip;
  hn::Vec<S> darker;  // the threshold minus 1, highest bit flipped
  explicit Brightness(std::uint32_t threshold)
      : flip(hn::BitCast(D(), hn::Set(S(), hwy::LimitsMin<hn::TFromD<S>>()))),
        darker(hn::BitCast(S(), hn::Xor(hn::Set(D(), static_cast<hn::TFromD<D>>(threshold - 1)), flip))) {}

  HWY_INLINE hn::Mask<S> operator()(hn::Vec<D> v) const { return hn::Gt(hn::BitCast(S(), hn::Xor(v, flip)), darker); }
};

/// Reads pixels of one byte.
struct BytePixels {
  using D = hn::CappedTag<std::uint8_t, 64>;
  using V = hn::Vec<D>;
  static constexpr std::size_t kBytes = 1;

  Brightness<D> bright;
  explicit BytePixels(const ScanRows& rows) : bright(rows.threshold) {}

  HWY_INLINE V load(const std::byte* at) const { return hn::LoadU(D(), reinterpret_cast<const std::uint8_t*>(at)); }
};

/// Reads pixels of two bytes.
struct WordPixels {
  using D = hn::CappedTag<std::uint16_t, 64>;
  using V = hn::Vec<D>;
  static constexpr std::size_t kBytes = 2;

  Brightness<D> bright;
  V kept;
  explicit WordPixels(const ScanRows& rows) : bright(rows.threshold), kept(hn::Set(D(), rows.kept)) {}

  HWY_INLINE V load(const std::byte* at) const {
    return hn::And(hn::LoadU(D(), reinterpret_cast<const std::uint16_t*>(at)), kept);
  }
};

/// The bits of 64 pixels; a set bit is a bright pixel.
template <class Pixels>
HWY_INLINE std::uint64_t bright_bits(const Pixels& pixels, const std::byte* at) {
  const hn::RebindToSigned<typename Pixels::D> d;
  constexpr std::size_t kLanes = hn::MaxLanes(typename Pixels::D());
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < 64; i += kLanes) {
    const auto mask = pixels.bright(pixels.load(at + i * Pixels::kBytes));
    std::uint8_t packed[8];
    hn::StoreMaskBits(d, mask, packed);
    std::uint64_t part = 0;
    std::memcpy(&part, packed, kLanes / 8);
    bits |= part << i;
  }
  return bits;
}

/// Appends the bright words of one row of each of `kRows` parts, from `part` on. No branch depends on the pixels: the
/// processor cannot predict which words are bright, and a misprediction costs as much as reading a thousand pixels. The
/// rows are read in turns, word by word, because memory delivers several streams faster than a single stream.
template <std::size_t kRows, class Pixels>
HWY_INLINE void scan_together(const Pixels& pixels, const ScanRows& rows, int y, int part, BrightWords& found) {
  constexpr std::size_t kWordBytes = 64 * Pixels::kBytes;
  const std::byte* at[kRows];
  std::uint32_t place[kRows];
  BrightWord *begin[kRows], *to[kRows];
  for (std::size_t k = 0; k < kRows; ++k) {
    const int row = y + static_cast<int>(k) * found.part_rows();
    at[k] = rows.bytes + static_cast<std::size_t>(row - rows.first_y) * rows.stride_bytes;
    place[k] = found.places().of(row, 0);
    begin[k] = to[k] = found.end(part + static_cast<int>(k));
  }
  const auto words = static_cast<std::size_t>(rows.width_px / 64);
  const int rest = rows.width_px % 64;
  for (std::size_t i = 0; i < words; ++i) {
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kRows; ++k) {
      const std::uint64_t bits = bright_bits(pixels, at[k] + i * kWordBytes);
      *to[k] = {bits, place[k] + static_cast<std::uint32_t>(i)};
      to[k] += bits != 0 ? 1 : 0;
    }
  }
  for (std::size_t k = 0; k < kRows; ++k) {
    if (rest != 0) {
      // The last pixels are read as the 64 pixels that end with the row.
      const std::byte* last = at[k] + static_cast<std::size_t>(rows.width_px - 64) * Pixels::kBytes;
      const std::uint64_t bits = bright_bits(pixels, last) >> (64 - rest);
      *to[k] = {bits, place[k] + static_cast<std::uint32_t>(words)};
      to[k] += bits != 0 ? 1 : 0;
    }
    found.count_row(begin[k], to[k]);
    found.end(part + static_cast<int>(k)) = to[k];
  }
}

template <class Pixels>
void scan(const ScanRows& rows, BrightWords& found) {
  const Pixels pixels(rows);
  const int part_rows = found.part_rows();
  if (rows.rows < found.rows()) {
    for (int y = rows.first_y; y < rows.first_y + rows.rows; ++y) {
      scan_together<1>(pixels, rows, y, found.part_of(y), found);
    }
    return;
  }
  // The last parts may have fewer rows than the first.
  const int in_all = std::max(0, rows.rows - (BrightWords::kParts - 1) * part_rows);
  for (int y = 0; y < in_all; ++y) scan_together<BrightWords::kParts>(pixels, rows, y, 0, found);
  for (int part = 0; part < BrightWords::kParts; ++part) {
    const int end = std::min(rows.rows, (part + 1) * part_rows);
    for (int y = part * part_rows + in_all; y < end; ++y) scan_together<1>(pixels, rows, y, part, found);
  }
}

template <class Pixels>
void scan_rows(const ScanRows& rows, BrightWords& found) {
  if (rows.width_px >= 64) return scan<Pixels>(rows, found);
  const DetectKernels& scalar = scalar_kernels();
  (Pixels::kBytes == 1 ? scalar.scan_bytes : scalar.scan_words)(rows, found);
}

using D16 = hn::CappedTag<std::uint16_t, kBoxStep_px>;
using S16 = hn::RebindToSigned<D16>;
using S32 = hn::Repartition<std::int32_t, D16>;
using V16 = hn::Vec<S16>;
using V32 = hn::Vec<S32>;

/// Adds products of lanes to sums. The lane of the sums to which a product is added is unspecified.
HWY_INLINE void add_products(V16 a, V16 b, V32& sums) {
  auto rest = hn::Zero(S32());
  sums = hn::ReorderWidenMulAccumulate(S32(), a, b, sums, rest);
  sums = hn::Add(sums, rest);
}

/// The sums of the lanes of four vectors.
HWY_INLINE void store_sums(V32 a, V32 b, V32 c, V32 d, std::int32_t (&sums)[4]) {
  const S32 d32;
  const hn::Repartition<std::int64_t, S32> d64;
  // Transposes blocks of four lanes and adds the rows of each block.
  const auto ab = hn::BitCast(d64, hn::Add(hn::InterleaveLower(d32, a, b), hn::InterleaveUpper(d32, a, b)));
  const auto cd = hn::BitCast(d64, hn::Add(hn::InterleaveLower(d32, c, d), hn::InterleaveUpper(d32, c, d)));
  const auto all =
      hn::Add(hn::BitCast(d32, hn::InterleaveLower(d64, ab, cd)), hn::BitCast(d32, hn::InterleaveUpper(d64, ab, cd)));
  // Each remaining block of four lanes has a part of all four sums.
  std::int32_t blocks[hn::MaxLanes(S32())];
  hn::StoreU(all, d32, blocks);
  for (std::size_t i = 0; i < 4; ++i) {
    sums[i] = blocks[i];
    for (std::size_t lane = i + 4; lane < hn::MaxLanes(S32()); lane += 4) sums[i] += blocks[lane];
  }
}

/// Accumulates the statistics of pixels: peak and number of bright pixels.
class Surveying {
 public:
  HWY_INLINE explicit Surveying(std::uint32_t threshold)
      : threshold_(hn::Set(d_, static_cast<std::uint16_t>(threshold))), peak_(hn::Zero(d_)), bright_(hn::Zero(d_)) {}

  HWY_INLINE void add(hn::Vec<D16> grey) {
    peak_ = hn::Max(peak_, grey);
    // A set mask lane is all ones, which is -1. A lane gets at most 192 x 12 pixels, which fits 16 bits.
    bright_ = hn::Sub(bright_, hn::VecFromMask(d_, hn::Eq(hn::Max(grey, threshold_), grey)));
  }

  BoxStatistics seen() const {
    const S16 signed16;
    auto bright = hn::Zero(S32());
    add_products(hn::BitCast(signed16, bright_), hn::Set(signed16, 1), bright);
    return {hn::GetLane(hn::MaxOfLanes(d_, peak_)),
            static_cast<std::uint32_t>(hn::GetLane(hn::SumOfLanes(S32(), bright)))};
  }

 private:
  D16 d_;
  hn::Vec<D16> threshold_;
  hn::Vec<D16> peak_, bright_;
};

BoxStatistics widen(const ByteWindow& window, const Box& box, std::uint16_t* pixels, std::uint32_t threshold) {
  const D16 d;
  const hn::Rebind<std::uint8_t, D16> d8;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(D16()));
  Surveying survey(threshold);
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

BoxStatistics survey(const Box& box, std::uint32_t threshold) {
  const D16 d;
  const int pixels = box.width_px * box.height_px;
  Surveying survey(threshold);
  for (int i = 0; i < pixels; i += static_cast<int>(hn::MaxLanes(D16()))) survey.add(hn::LoadU(d, box.pixels + i));
  return survey.seen();
}

/// The sums of one power of u. The sums of columns have 16 bits and are added to the other sums every kRows rows.
class PowerSums {
 public:
  static constexpr int kRows = 16;  // 16 * 2047 is less than 2^15

  HWY_INLINE PowerSums() : weight(hn::Zero(S32())), x(weight), y(weight), column_(hn::Zero(S16())) {}
  HWY_INLINE void add(V16 power, V16 at_y) {
    column_ = hn::Add(column_, power);
    add_products(power, at_y, y);
  }
  HWY_INLINE void fold(V16 at_x) {
    add_products(column_, hn::Set(S16(), 1), weight);
    add_products(column_, at_x, x);
    column_ = hn::Zero(S16());
  }

  V32 weight, x, y;

 private:
  V16 column_;
};

BoxSums weigh(const Box& box, const IntensityRamp& weighing) {
  const D16 d;
  const S16 s;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(D16()));
  const Scale scale(weighing.span);
  const auto low = hn::Set(d, static_cast<std::uint16_t>(weighing.low));
  const auto span = hn::Set(d, static_cast<std::uint16_t>(weighing.span));
  const auto factor = hn::Set(d, static_cast<std::uint16_t>(scale.factor));
  const auto one = hn::Set(s, 1);
  PowerSums first, second, third;
  auto slopes2 = hn::Zero(S32());
  for (int begin = 0; begin < box.width_px; begin += kLanes) {
    const auto x = hn::Add(hn::Iota(s, 0), hn::Set(s, static_cast<std::int16_t>(begin - box.width_px / 2)));
    const int top_y = -(box.height_px / 2);
    auto y = hn::Set(s, static_cast<std::int16_t>(top_y));
    const std::uint16_t* from = box.pixels + begin;
    for (int top = 0; top < box.height_px; top += PowerSums::kRows) {
      const int end = std::min(box.height_px, top + PowerSums::kRows);
      for (int row = top; row < end; ++row, from += box.width_px) {
        const auto over = hn::Min(hn::SaturatedSub(hn::LoadU(d, from), low), span);
        const auto u = hn::MulHigh(hn::ShiftLeftSame(over, scale.shift), factor);
        const auto u2 = hn::MulHigh(hn::ShiftLeft<5>(u), u);
        const auto u3 = hn::MulHigh(hn::ShiftLeft<5>(u2), u);
        first.add(hn::BitCast(s, u), y);
        second.add(hn::BitCast(s, u2), y);
        third.add(hn::BitCast(s, u3), y);
        const auto slope = hn::BitCast(s, hn::ShiftRight<4>(hn::Add(hn::Sub(u, u2), hn::Set(d, 8))));
        add_products(slope, slope, slopes2);
        y = hn::Add(y, one);
      }
      for (PowerSums* const power : {&first, &second, &third}) power->fold(x);
    }
  }
  BoxSums sums;
  std::int32_t weights[4], xs[4], ys[4];
  store_sums(first.weight, second.weight, third.weight, slopes2, weights);
  store_sums(first.x, second.x, third.x, third.x, xs);
  store_sums(first.y, second.y, third.y, third.y, ys);
  for (int i = 0; i < kPowers; ++i) {
    sums.weight[i] = weights[i];
    sums.x[i] = xs[i];
    sums.y[i] = ys[i];
  }
  sums.slope2 = weights[3];
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
}  // namespace mocap::detect::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace mocap::detect {
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

}  // namespace mocap::detect
#endif
