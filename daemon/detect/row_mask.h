#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/kernels/bright_words.h"
#include "detect/kernels/detect_kernels.h"
#include "model/image_mask.h"

namespace mocap::detect {

/// Masked pixels. Cost nothing where nothing shines: only words with a bright pixel are masked.
class RowMask {
 public:
  /// Pixels whose centre is within one of the polygons; polygons may reach out of the image.
  RowMask(std::span<const MaskPolygon> polygons, int width_px, int height_px);

  bool empty() const { return bits_.empty(); }

  /// Takes the masked pixels out of `words`.
  void clear_masked(std::span<BrightWord> words) const;

  /// Whether a masked pixel may be beside or within the box, whose ends are exclusive. Most boxes are far from all
  /// masks, which takes few steps to tell.
  bool may_touch(int begin_x, int end_x, int begin_y, int end_y) const;

  /// Whether a masked pixel is beside the run, also by a corner.
  bool touches(const Run& run) const;

  bool masks(int x, int y) const { return has_masked(y, x, x + 1); }

  /// How many pixels are masked.
  std::size_t count() const;

 private:
  std::size_t first_word(int y) const { return places_.of(y, 0); }
  void fill(int y, int begin, int end);
  bool has_masked(int y, int begin, int end) const;

  int width_px_, height_px_;
  WordPlaces places_;
  std::vector<std::uint64_t> bits_;   // by place; empty: nothing is masked
  std::vector<std::uint64_t> words_;  // which words have a masked pixel, a bit each, by place
  std::vector<std::uint64_t> bands_;  // what is masked in any of kBandRows rows, by place of the band
};

}  // namespace mocap::detect
