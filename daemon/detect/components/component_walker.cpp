#include "detect/components/component_walker.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include "base/loops.h"

namespace mocap::detect {
namespace {

__extension__ using Bits128 = unsigned __int128;
template <class Bits>
constexpr int kWidth = 8 * static_cast<int>(sizeof(Bits));

inline int zeros_below(std::uint64_t bits) { return std::countr_zero(bits); }
inline int zeros_below(Bits128 bits) {
  const auto low = static_cast<std::uint64_t>(bits);
  return low != 0 ? std::countr_zero(low) : 64 + std::countr_zero(static_cast<std::uint64_t>(bits >> 64U));
}
inline int zeros_above(std::uint64_t bits) { return std::countl_zero(bits); }
inline int zeros_above(Bits128 bits) {
  const auto high = static_cast<std::uint64_t>(bits >> 64U);
  return high != 0 ? std::countl_zero(high) : 64 + std::countl_zero(static_cast<std::uint64_t>(bits));
}

/// A mask of `count` bits (1 or more) from bit `first` on.
template <class Bits>
inline Bits bits_at(int first, int count) {
  return ~Bits{0} >> ((kWidth<Bits> - count) & (kWidth<Bits> - 1)) << first;
}

/// The pixels of a run and the pixel on either side.
template <class Bits>
inline Bits grown(Bits run) {
  return run | run << 1U | run >> 1U;
}

/// The run that contains bit `i`, which is set.
template <class Bits>
inline Bits run_around(Bits bits, int i) {
  const int up = zeros_below(static_cast<Bits>(~(bits >> i)));
  const int down = zeros_above(static_cast<Bits>(~(bits << (kWidth<Bits> - 1 - i))));
  return bits_at<Bits>(i - down + 1, up + down - 1);
}

template <class Bits>
inline Bits without_first_run(Bits bits) {
  return bits & (bits + (bits & (~bits + 1)));
}

constexpr int kLead = 24;  // pixels of a window to the left of the component's first pixel
constexpr std::size_t kWindowRows = 128;
/// One number for each of eight rows.
using Lanes = std::int32_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline std::int64_t total(Lanes lanes) {
  auto half = __builtin_shufflevector(lanes, lanes, 0, 1, 2, 3) + __builtin_shufflevector(lanes, lanes, 4, 5, 6, 7);
  half += __builtin_shufflevector(half, half, 2, 3, 0, 1);
  half += __builtin_shufflevector(half, half, 1, 0, 3, 2);
  return half[0];
}

/// The sums over the runs of consecutive rows from 0 on, without the bounding box. The array has capacity for 8 more
/// rows. For 128 rows of 128 pixels each sum fits 32 bits.
[[gnu::always_inline]] inline RunSums sums_of(std::uint32_t* spans, std::size_t rows) {
  std::memset(spans + rows, 0, sizeof(Lanes));  // padding: a run of length 0 adds nothing
  Lanes n{}, x{}, xx{}, cubes{}, y{}, yy{}, xy{}, at_y{0, 1, 2, 3, 4, 5, 6, 7};
  for (std::size_t i = 0; i < rows; i += 8) {
    Lanes span;
    std::memcpy(&span, spans + i, sizeof(span));
    const Lanes begin = span & 0xFFFF, end = span >> 16;
    const Lanes length = end - begin, middle = begin + end - 1, sum = length * middle, at = length * at_y;
    n += length;
    x += sum;
    xx += sum * middle;
    cubes += length * length * length;
    y += at;
    yy += at * at_y;
    xy += sum * at_y;
    at_y += 8;
  }
  return {total(n), total(x), total(y), total(xx), total(cubes), total(yy), total(xy)};
}

/// A window of 64 or 128 pixels of a row, from any x on.
template <class Bits>
struct Window {
  std::uint64_t* at;
  int shift;

  void move(std::ptrdiff_t words) { at += words; }
  std::uint64_t read(int i) const { return at[i] >> shift | at[i + 1] << 1U << (63 - shift); }
  Bits read() const {
    if constexpr (kWidth<Bits> == 64) {
      return read(0);
    } else {
      return static_cast<Bits>(read(1)) << 64U | read(0);
    }
  }
  void wipe(int i, std::uint64_t pixels) const {
    at[i] &= ~(pixels << shift);
    at[i + 1] &= ~(pixels >> 1U >> (63 - shift));
  }
  void wipe(Bits pixels) const {
    wipe(0, static_cast<std::uint64_t>(pixels));
    if constexpr (kWidth<Bits> == 128) wipe(1, static_cast<std::uint64_t>(pixels >> 64U));
  }
};

}  // namespace

ComponentWalker::ComponentWalker(int width_px, int height_px, std::size_t max_runs)
    : places_(width_px),
      bits_(static_cast<std::size_t>(places_.pitch()) * (static_cast<std::size_t>(height_px) + 2)),
      words_(bits_.data() + places_.pitch() + 1),
      // The last component of a part may exceed the bound of the part, and sums_of() writes 8 rows of padding.
      spans_(max_runs + BrightWords::kParts * kWindowRows + sizeof(Lanes) / sizeof(Span)),
      runs_(kWindowRows),
      found_(spans_.size()) {}

void ComponentWalker::draw(std::span<const BrightWord> words) {
  std::uint64_t* const first = words_;
  for (const BrightWord& each : words) first[each.place] = each.bits;
}

void ComponentWalker::wipe(std::span<const BrightWord> words) {
  for (const BrightWord& each : words) words_[each.place] = 0;
}

std::span<const Run> ComponentWalker::runs(const PlainComponent& component) {
  for (std::uint32_t i = 0; i < component.rows; ++i) {
    const Span span = spans_[component.first_span + i];
    runs_[i] = {static_cast<std::uint16_t>(component.sums.begin_y + static_cast<int>(i)),
                static_cast<std::uint16_t>(component.window_x + static_cast<int>(span & 0xFFFFU)),
                static_cast<std::uint16_t>(component.window_x + static_cast<int>(span >> 16U))};
  }
  return std::span(runs_).first(component.rows);
}

void ComponentWalker::begin_image() {
  span_count_ = count_ = walked_ = 0;
  too_small_ = 0;
}

/// Stores the component whose first pixel is at (x, y), if it has one run per row. Precondition: the pixel to the left
/// of (x, y) is dark. Returns false if the component does not fit into the window.
template <class Bits>
[[gnu::always_inline]] inline bool ComponentWalker::walk_through(int y, int x) {
  constexpr Bits kRim = Bits{1} | Bits{1} << (kWidth<Bits> - 1);
  const std::ptrdiff_t pitch = places_.pitch();
  const int begin_x = x - kLead;
  const Window<Bits> above{at(y - 1, begin_x >> 6), begin_x & 63};
  Window<Bits> window = above;
  window.move(pitch);
  Bits bits = window.read();
  Bits run = bits_at<Bits>(kLead, zeros_below(static_cast<Bits>(~(bits >> kLead))));
  Bits reach = grown(run);
  if ((above.read() & reach) != 0) return true;
  std::array<Bits, kWindowRows> runs;
  std::size_t count = 0;
  while (true) {
    if ((run & kRim) != 0 || count == kWindowRows) return false;
    runs[count++] = run;
    const Bits others = bits ^ run;
    window.move(pitch);
    bits = window.read();
    const Bits touched = bits & reach;
    if (touched == 0) break;
    run = without_first_run(bits) == 0 ? bits : run_around(bits, zeros_below(touched));
    reach = grown(run);
    if (((touched & ~run) | (others & reach)) != 0) return true;
  }
  store<Bits>(begin_x, y, std::span(runs).first(count));
  return true;
}

/// Clears the runs in the bit image and stores them as a component, unless their area is below the least area.
template <class Bits>
[[gnu::always_inline]] inline void ComponentWalker::store(int begin_x, int y, std::span<const Bits> runs) {
  const std::ptrdiff_t pitch = places_.pitch();
  Window<Bits> window{at(y, begin_x >> 6), begin_x & 63};
  Span* const spans = spans_.data() + span_count_;
  Bits all = 0;
  Span area_px2 = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Bits run = runs[i];
    const auto begin = static_cast<Span>(zeros_below(run)), end = static_cast<Span>(kWidth<Bits> - zeros_above(run));
    spans[i] = begin | end << 16U;
    area_px2 += end - begin;
    all |= run;
    window.wipe(run);
    window.move(pitch);
  }
  walked_ += runs.size();
  if (area_px2 < min_area_px2_) {
    ++too_small_;
    return;
  }
  RunSums sums = sums_of(spans, runs.size());
  sums.begin_x = zeros_below(all);
  sums.end_x = kWidth<Bits> - zeros_above(all);
  sums.end_y = static_cast<int>(runs.size());
  sums.move(begin_x, y);
  found_[count_++] = {sums, begin_x + kLead, begin_x, static_cast<std::uint32_t>(span_count_),
                      static_cast<std::uint32_t>(runs.size())};
  span_count_ += runs.size();
}

/// Clears the components of a single pixel in a word, except at the ends of the word, and counts them as too small.
/// Returns the remaining pixels of the word.
[[gnu::always_inline]] inline std::uint64_t ComponentWalker::clear_single(std::uint64_t* at, std::uint64_t bits) {
  constexpr std::uint64_t kEnds = 1ULL | 1ULL << 63U;
  const std::ptrdiff_t pitch = places_.pitch();
  const std::uint64_t beside = grown(at[-pitch]) | grown(at[pitch]) | bits << 1U | bits >> 1U;
  const std::uint64_t single = bits & ~(beside | kEnds);
  if (single == 0) return bits;
  const int count = std::popcount(single);
  at[0] = bits ^ single;
  walked_ += static_cast<std::size_t>(count);
  too_small_ += static_cast<std::uint32_t>(count);
  return at[0];
}

MOCAP_BITS ComponentWalker::Walked ComponentWalker::walk(std::span<BrightWord> words, std::uint32_t min_area_px2,
                                                         std::size_t max_runs) {
  min_area_px2_ = min_area_px2;
  std::uint64_t* const first = words_;
  const std::size_t most_walked = walked_ + max_runs;
  std::size_t runs_left = 0;
  BrightWord* left = words.data();
  for (std::size_t i = 0; i < words.size(); ++i) {
    const BrightWord each = words[i];
    std::uint64_t* const at = first + each.place;
    std::uint64_t bits = at[0];
    if (bits == 0) continue;  // all pixels belong to components that were found from rows above
    if (min_area_px2 > 1) {
      bits = clear_single(at, bits);
      if (bits == 0) continue;
    }
    // A run that continues from the previous word has its first pixel there.
    const std::uint64_t goes_on = at[-1] >> 63U;
    if ((goes_on & bits) != 0) bits = without_first_run(bits);
    const int y = places_.y(each), word_x = places_.x(each, y);
    for (; bits != 0 && walked_ + runs_left <= most_walked; bits = without_first_run(bits)) {
      const int x = word_x + std::countr_zero(bits);
      if (!walk_through<std::uint64_t>(y, x)) walk_through<Bits128>(y, x);
    }
    const std::uint64_t rest = at[0];
    *left = {rest, each.place};
    left += rest != 0 ? 1 : 0;
    runs_left += static_cast<std::size_t>(std::popcount(rest & ~(rest << 1U | goes_on)));
    if (walked_ + runs_left > most_walked) {
      wipe(words.subspan(i + 1));
      return {{words.data(), left}, words.subspan(i + 1)};
    }
  }
  return {{words.data(), left}, {}};
}

}  // namespace mocap::detect
