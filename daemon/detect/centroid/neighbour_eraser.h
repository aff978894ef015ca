#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// Takes the light of its neighbours out of a component's surroundings: their bright pixels, and what lies no further
/// from one of those than from the component's own.
///
/// Works on bits, 64 pixels at a time. All memory is taken in the constructor. One thread at a time.
class NeighbourEraser {
 public:
  /// Pixels up to `reach_px` from a bright one, across and down, belong to it.
  explicit NeighbourEraser(int reach_px);

  /// Sets to 0 what is the neighbours' in `pixels`, which are those of the box. `runs` are the component's, the box's
  /// first pixel is at (first_x, first_y).
  void erase(std::span<const Run> runs, int first_x, int first_y, std::uint32_t threshold, const Box& box,
             std::span<std::uint16_t> pixels);

 private:
  /// A pixel seen from another.
  struct Step {
    int across, down;
    bool is_farther;  // than the one before
  };
  using Bits = std::vector<std::uint64_t>;

  void draw(std::span<const Run> runs, int first_x, int first_y, std::uint32_t threshold, const Box& box);
  std::uint64_t shifted(const Bits& bits, std::size_t word, const Step& step) const;
  std::uint64_t erased(std::size_t word) const;
  std::size_t word_at(int y, int i) const;

  int reach_;
  std::vector<Step> steps_;  // from near to far
  Bits own_, others_;        // rows of words, with dark ones around them
};

}  // namespace mocap::detect
