#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/components/shape.h"
#include "detect/kernels/bright_words.h"
#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// A component with one run in each of its rows.
struct PlainComponent {
  RunSums sums;
  int first_x = 0;   // of its first run
  int window_x = 0;  // of the window that it was seen through
  std::uint32_t first_span = 0, rows = 0;
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
  /// A component's runs, until it is asked for those of another.
  std::span<const Run> runs(const PlainComponent& component);
  std::uint32_t too_small() const { return too_small_; }

 private:
  /// A run in a window: its begin, and its end in the upper half.
  using Span = std::uint32_t;

  std::uint64_t* at(int y, int word) { return words_ + static_cast<std::ptrdiff_t>(places_.pitch()) * y + word; }
  std::uint64_t take_single(std::uint64_t* at, std::uint64_t bits);
  template <class Bits>
  bool walk_through(int y, int x);
  template <class Bits>
  void take(int begin_x, int y, std::span<const Bits> runs);

  WordPlaces places_;
  std::vector<std::uint64_t> bits_;  // rows with dark words between them, and a dark row above and below
  std::uint64_t* words_;             // by place
  std::vector<Span> spans_;
  std::vector<Run> runs_;  // those asked for
  std::vector<PlainComponent> found_;
  std::size_t span_count_ = 0, count_ = 0;
  std::size_t walked_ = 0;  // runs, with those of what is too small
  std::uint32_t min_area_px2_ = 1;
  std::uint32_t too_small_ = 0;
};

}  // namespace mocap::detect
