#include "detect/centroid/neighbour_eraser.h"

#include <algorithm>
#include <bit>

#include "detect/bit_rows.h"

namespace mocap::detect {
namespace {

constexpr int kRowWords = kMaxBox_px / 64 + 2;  // the first and the last word are dark

int distance2(int across, int down) { return across * across + down * down; }

}  // namespace

NeighbourEraser::NeighbourEraser(int reach_px)
    : reach_(reach_px), own_(static_cast<std::size_t>(kRowWords * (kMaxBox_px + 2 * reach_px))), others_(own_.size()) {
  for (int down = -reach_px; down <= reach_px; ++down) {
    for (int across = -reach_px; across <= reach_px; ++across) {
      if (across != 0 || down != 0) steps_.push_back({across, down, false});
    }
  }
  std::ranges::stable_sort(steps_, {}, [](const Step& step) { return distance2(step.across, step.down); });
  for (std::size_t i = 1; i < steps_.size(); ++i) {
    const Step &last = steps_[i - 1], &step = steps_[i];
    steps_[i].is_farther = distance2(step.across, step.down) > distance2(last.across, last.down);
  }
}

std::size_t NeighbourEraser::word_at(int y, int i) const {
  return static_cast<std::size_t>((y + reach_) * kRowWords + i + 1);
}

void NeighbourEraser::draw(std::span<const Run> runs, int first_x, int first_y, std::uint32_t threshold,
                           const Box& box) {
  const std::size_t end = word_at(box.height_px + reach_, -1);
  std::fill_n(own_.begin(), end, std::uint64_t{0});
  std::fill_n(others_.begin(), end, std::uint64_t{0});
  for (const Run& run : runs) {
    const int y = run.y - first_y;
    for (int x = run.begin - first_x; x < run.end - first_x; x = (x | 63) + 1) {
      own_[word_at(y, x / 64)] |= bits_between(x, run.end - first_x);
    }
  }
  const std::uint16_t* pixel = box.pixels;
  for (int y = 0; y < box.height_px; ++y) {
    for (int x = 0; x < box.width_px; ++x, ++pixel) {
      others_[word_at(y, x / 64)] |= static_cast<std::uint64_t>(*pixel >= threshold) << (x % 64);
    }
    for (int i = 0; i < words_of(box.width_px); ++i) others_[word_at(y, i)] &= ~own_[word_at(y, i)];
  }
}

/// The pixels of a word from which the offset `step` leads to a pixel of `bits`.
std::uint64_t NeighbourEraser::shifted(const Bits& bits, std::size_t word, const Step& step) const {
  const std::uint64_t* at = bits.data() + static_cast<std::ptrdiff_t>(word) + step.down * kRowWords;
  if (step.across > 0) return at[0] >> step.across | at[1] << (64 - step.across);
  if (step.across < 0) return at[0] << -step.across | at[-1] >> (64 + step.across);
  return at[0];
}

std::uint64_t NeighbourEraser::erased(std::size_t word) const {
  std::uint64_t erased = others_[word], open = ~(own_[word] | others_[word]);
  std::uint64_t near_own = 0, near_other = 0;
  for (const Step& step : steps_) {
    if (step.is_farther) {
      erased |= open & near_other;
      open &= ~near_own;
    }
    near_own |= shifted(own_, word, step);
    near_other |= shifted(others_, word, step);
  }
  return erased | (open & near_other);
}

void NeighbourEraser::erase(std::span<const Run> runs, int first_x, int first_y, std::uint32_t threshold,
                            const Box& box, std::span<std::uint16_t> pixels) {
  draw(runs, first_x, first_y, threshold, box);
  for (int y = 0; y < box.height_px; ++y) {
    for (int x = 0; x < box.width_px; x += 64) {
      std::uint64_t bits = erased(word_at(y, x / 64)) & bits_between(x, box.width_px);
      for (; bits != 0; bits &= bits - 1) {
        pixels[static_cast<std::size_t>(y * box.width_px + x + std::countr_zero(bits))] = 0;
      }
    }
  }
}

}  // namespace mocap::detect
