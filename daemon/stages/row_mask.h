#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/image_mask.h"
#include "stages/detect_kernels.h"

namespace mocap::stages {

/// Masked stretches of every row. Costs nothing where nothing shines: runs are cut, not pixels.
class RowMask {
 public:
  /// Pixels whose centre is within one of the polygons; polygons may reach out of the image.
  RowMask(std::span<const MaskPolygon> polygons, int width_px, int height_px);

  bool empty() const { return stretches_.empty(); }

  /// Takes the masked pixels out of `runs`, which are in the order of rows and x. Gives what is left, in the same
  /// order; what finds no room in `left` is lost.
  std::size_t cut(std::span<const Run> runs, std::span<Run> left) const;

  /// Whether a masked pixel is beside the run, also by a corner.
  bool touches(const Run& run) const;

  bool masks(int x, int y) const;

  /// How many pixels are masked.
  std::size_t count() const;

 private:
  struct Stretch {
    std::uint16_t begin, end;
  };
  std::span<const Stretch> row(int y) const;
  bool meets(int y, int begin, int end) const;

  std::vector<std::uint32_t> first_;  // of each row, among the stretches; one more at the end
  std::vector<Stretch> stretches_;
};

}  // namespace mocap::stages
