#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/components/shape.h"
#include "detect/kernels/bright_words.h"
#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// A component with exactly one run in each of its rows.
struct PlainComponent {
  RunSums sums;
  int first_x = 0;   // x of the first run
  int window_x = 0;  // x of the window
  std::uint32_t first_span = 0, rows = 0;
};

/// Finds the components of a binary image that have one run in each of at most 128 rows, as nearly all markers have.
/// Follows each component down from its first row in a window of 64 pixels (one word per row), or of 128 pixels if the
/// component is wider. The runs must lie within the window: up to 23 pixels to the left of the first pixel, and up to
/// 102 pixels to its right.
///
/// Thread: one. Allocates in the constructor only.
class ComponentWalker {
 public:
  /// `max_runs`: bound on the runs at which components begin, per image.
  ComponentWalker(int width_px, int height_px, std::size_t max_runs);

  /// Writes words of an image into the bit image.
  void draw(std::span<const BrightWord> words);
  /// Clears the written words.
  void wipe(std::span<const BrightWord> words);

  /// Discards the components of the previous image.
  void begin_image();
  struct Walked {
    std::span<BrightWord> left;    ///< words of other components, moved to the front, still in the bit image
    std::span<BrightWord> unread;  ///< words beyond the bound of `max_runs` runs, cleared
  };
  /// Finds the components with one run per row among the written words, in the order of their first pixel, and clears
  /// them. Components below the least area are dropped and counted. All parts of an image are written before the first
  /// call; parts are processed from the top down, with at most `max_runs` runs in total.
  Walked walk(std::span<BrightWord> words, std::uint32_t min_area_px2, std::size_t max_runs);

  std::span<const PlainComponent> found() const { return std::span(found_).first(count_); }
  /// The runs of a component; valid until the next call.
  std::span<const Run> runs(const PlainComponent& component);
  std::uint32_t too_small() const { return too_small_; }

 private:
  /// A run in a window: begin in the lower half, end in the upper half.
  using Span = std::uint32_t;

  std::uint64_t* at(int y, int word) { return words_ + static_cast<std::ptrdiff_t>(places_.pitch()) * y + word; }
  std::uint64_t clear_single(std::uint64_t* at, std::uint64_t bits);
  template <class Bits>
  bool walk_through(int y, int x);
  template <class Bits>
  void store(int begin_x, int y, std::span<const Bits> runs);

  WordPlaces places_;
  std::vector<std::uint64_t> bits_;  // rows, separated by dark words, with a dark row above and below
  std::uint64_t* words_;             // by word index
  std::vector<Span> spans_;
  std::vector<Run> runs_;  // runs of the last query
  std::vector<PlainComponent> found_;
  std::size_t span_count_ = 0, count_ = 0;
  std::size_t walked_ = 0;  // runs visited, including those of components that are too small
  std::uint32_t min_area_px2_ = 1;
  std::uint32_t too_small_ = 0;
};

}  // namespace mocap::detect
