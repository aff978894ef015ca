#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/components/component_walker.h"
#include "detect/components/run_components.h"
#include "detect/kernels/bright_words.h"
#include "detect/row_mask.h"

namespace mocap::detect {

/// The components of an image: bright pixels that touch, also by a corner, less what is masked. Those with one run in
/// each row are walked down at once; the runs of all others are joined.
///
/// All memory is taken in the constructor. One thread at a time.
class ImageComponents {
 public:
  ImageComponents(int width_px, int height_px, std::span<const MaskPolygon> masks);

  /// Where the next image's bright words are to be written.
  BrightWords& room() { return words_; }
  const BrightWords& room() const { return words_; }

  /// Joins what is in the room, and keeps the components whose area is within the bounds, the `max_count` largest at
  /// most.
  void join(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count);

  /// The components kept, in the order of their first pixel.
  std::size_t count() const { return selected_.size(); }
  Shape shape(std::size_t i) const { return shape_of(sums(selected_[i])); }
  /// A component's runs, by row, then x.
  std::span<const Run> runs(std::size_t i);
  /// Whether a masked pixel is beside it, also by a corner.
  bool touches_mask(std::size_t i);

  std::uint32_t too_small() const { return too_small_; }  ///< components under the least area
  std::uint32_t too_large() const { return too_large_; }
  std::uint32_t dropped() const { return dropped_; }  ///< components over `max_count`
  /// Rows all over bright with too many runs, and those of a part that had used up its share of all runs.
  std::uint32_t rows_given_up() const { return rows_given_up_; }

 private:
  struct SelectedComponent {
    std::uint32_t first_px;  // the place of its first pixel, in the order of rows and x
    std::uint32_t index;     // among the plain ones, or those joined
    bool is_plain;
  };

  const RunSums& sums(const SelectedComponent& selected) const {
    return selected.is_plain ? walker_.found()[selected.index].sums : joined_.sums(selected.index);
  }
  void reject_noise_rows(std::span<BrightWord> words);
  void merge(std::uint32_t max_area_px2);
  void keep_largest(std::size_t max_count);

  std::size_t max_runs_, row_run_bound_, noise_words_;
  RowMask mask_;
  std::vector<BrightWord> word_room_;
  BrightWords words_;
  ComponentWalker walker_;
  RunComponents joined_;
  std::vector<SelectedComponent> selected_;
  std::uint32_t too_small_ = 0, too_large_ = 0, dropped_ = 0, rows_given_up_ = 0;
};

}  // namespace mocap::detect
