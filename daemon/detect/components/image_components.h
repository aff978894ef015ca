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

/// The components of an image: 8-connected bright pixels without the masked ones. ComponentWalker finds the components
/// with one run per row; RunComponents joins the runs of all others.
///
/// Thread: one. Allocates in the constructor only.
class ImageComponents {
 public:
  ImageComponents(int width_px, int height_px, std::span<const MaskPolygon> masks);

  /// The buffer for the bright words of the next image.
  BrightWords& room() { return words_; }
  const BrightWords& room() const { return words_; }

  /// Finds the components of the words in the buffer. Keeps the components whose area is within the bounds, at most the
  /// `max_count` largest.
  void join(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count);

  /// The kept components, in the order of their first pixel.
  std::size_t count() const { return selected_.size(); }
  Shape shape(std::size_t i) const { return shape_of(sums(selected_[i])); }
  /// A component's runs, by row, then x.
  std::span<const Run> runs(std::size_t i);
  /// Whether a masked pixel is an 8-neighbour of the component.
  bool touches_mask(std::size_t i);

  bool is_masked(int x, int y) const { return !mask_.empty() && mask_.masks(x, y); }

  std::uint32_t too_small() const { return too_small_; }  ///< components below the least area
  std::uint32_t too_large() const { return too_large_; }
  std::uint32_t dropped() const { return dropped_; }  ///< components over `max_count`
  /// Rows that were dropped as noise, see make_blob_detector.
  std::uint32_t rows_given_up() const { return rows_given_up_; }

 private:
  struct SelectedComponent {
    std::uint32_t first_px;  // index of its first pixel, row by row
    std::uint32_t index;     // among the components of the walker, or of RunComponents
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
