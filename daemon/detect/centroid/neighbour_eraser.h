#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// Removes the light of other components from the box around a component: their bright pixels, and each pixel that is
/// at most as far from them as from the component's own bright pixels.
///
/// Works on bits, 64 pixels at a time. Thread: one. Allocates in the constructor only.
class NeighbourEraser {
 public:
  /// A bright pixel of another component removes the pixels within `reach_px`, horizontally and vertically.
  explicit NeighbourEraser(int reach_px);

  /// Sets the pixels of other components in `pixels`, the pixels of the box, to 0. `runs` are the component's own; the
  /// box's first pixel is at (first_x, first_y).
  void erase(std::span<const Run> runs, int first_x, int first_y, std::uint32_t threshold, const Box& box,
             std::span<std::uint16_t> pixels);

 private:
  /// Offset from one pixel to another.
  struct Step {
    int across, down;
    bool is_farther;  // farther than the previous step
  };
  using Bits = std::vector<std::uint64_t>;

  void draw(std::span<const Run> runs, int first_x, int first_y, std::uint32_t threshold, const Box& box);
  std::uint64_t shifted(const Bits& bits, std::size_t word, const Step& step) const;
  std::uint64_t erased(std::size_t word) const;
  std::size_t word_at(int y, int i) const;

  int reach_;
  std::vector<Step> steps_;  // by ascending distance
  Bits own_, others_;        // rows of words, surrounded by dark words
};

}  // namespace mocap::detect
