#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/kernels/bright_words.h"
#include "detect/kernels/detect_kernels.h"
#include "model/image_mask.h"

namespace mocap::detect {

/// The masked pixels of a camera. Only words with a bright pixel are masked, so that a dark image costs nothing.
class RowMask {
 public:
  /// Masks each pixel whose centre lies within one of the polygons. Polygons may extend beyond the image.
  RowMask(std::span<const MaskPolygon> polygons, int width_px, int height_px);

  bool empty() const { return bits_.empty(); }

  /// Clears the masked pixels of `words`.
  void clear_masked(std::span<BrightWord> words) const;

  /// Whether a masked pixel may lie within or next to the box, whose ends are exclusive. Conservative, and fast for a
  /// box far from all masks.
  bool may_touch(int begin_x, int end_x, int begin_y, int end_y) const;

  /// Whether a masked pixel is an 8-neighbour of the run.
  bool touches(const Run& run) const;

  bool masks(int x, int y) const { return has_masked(y, x, x + 1); }

  /// Number of masked pixels.
  std::size_t count() const;

 private:
  std::size_t first_word(int y) const { return places_.of(y, 0); }
  void fill(int y, int begin, int end);
  bool has_masked(int y, int begin, int end) const;

  int width_px_, height_px_;
  WordPlaces places_;
  std::vector<std::uint64_t> bits_;   // by word index; empty: no mask
  std::vector<std::uint64_t> words_;  // one bit per word: the word has a masked pixel
  std::vector<std::uint64_t> bands_;  // union of the masks of kBandRows rows, by word index of the band
};

}  // namespace mocap::detect
