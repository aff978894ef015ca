#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stages/bright_words.h"
#include "stages/detect_kernels.h"
#include "stages/shape.h"

namespace mocap::stages {

/// A component with one run in each of its rows.
struct PlainComponent {
  RunSums sums;
  std::uint32_t first_run = 0, runs = 0;
};

/// Finds the components of a binary image that have one run in each row, of up to 100 pixels, and up to 128 rows:
/// nearly all that markers are. Walks down each from its first row, through a window of 64 pixels, one word of bits a
/// row, or of 128 where that does not do.
///
/// All memory is taken in the constructor. One thread at a time.
class ComponentWalker {
 public:
  /// Components may begin with `max_runs` runs in all.
  ComponentWalker(int width_px, int height_px, std::size_t max_runs);

  /// Draws words of an image into it.
  void draw(std::span<const BrightWord> words);
  /// Wipes what was drawn.
  void wipe(std::span<const BrightWord> words);

  /// Forgets what was found before.
  void begin_image();
  struct Walked {
    std::span<BrightWord> left;    ///< moved to the front of the words, still drawn
    std::span<BrightWord> unread;  ///< words after those with `max_runs` runs, wiped
  };
  /// Finds the plain components among the words drawn, those under the least area left out and counted, in the order of
  /// their first pixel, and wipes them. All parts of an image are drawn before the first is walked, and walked from the
  /// top down, with at most `max_runs` of the constructor in all.
  Walked walk(std::span<BrightWord> words, std::uint32_t min_area_px2, std::size_t max_runs);

  std::span<const PlainComponent> found() const { return std::span(found_).first(count_); }
  std::span<const Run> runs(const PlainComponent& component) const {
    return std::span(runs_).subspan(component.first_run, component.runs);
  }
  std::uint32_t too_small() const { return too_small_; }

 private:
  std::uint64_t* row(int y) { return bits_.data() + static_cast<std::size_t>(y + 1) * pitch_ + 1; }
  std::uint64_t take_single(std::uint64_t* at, std::uint64_t bits);
  template <class Bits>
  bool walk_through(int y, int x);
  template <class Bits>
  void take(int begin_x, int y, std::span<const Bits> runs);

  std::size_t pitch_;                // words of a row, with some dark ones before and after it
  std::vector<std::uint64_t> bits_;  // rows, with a dark one above and below
  std::vector<Run> runs_;
  std::vector<PlainComponent> found_;
  std::size_t run_count_ = 0, count_ = 0;
  std::size_t walked_ = 0;  // runs, with those of what is too small
  std::int64_t min_area_px2_ = 1;
  std::uint32_t too_small_ = 0;
};

}  // namespace mocap::stages
