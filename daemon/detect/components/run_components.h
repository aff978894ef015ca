#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/components/shape.h"
#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// Joins the runs of bright pixels of an image to 8-connected components.
///
/// Thread: one. Allocates in the constructor only.
///
/// Source: He, Chao, Suzuki, "A run-based two-scan labeling algorithm", IEEE Trans. Image Processing 17 (2008), with
/// union by the smaller label and path halving.
class RunComponents {
 public:
  explicit RunComponents(std::size_t max_runs);

  /// The buffer for the runs of the next image, in the order of rows, then x.
  std::span<Run> room() { return runs_; }

  /// Joins the first `count` runs in the buffer. Keeps the components whose area is within the bounds, at most the
  /// `max_count` largest.
  void join(std::size_t count, std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count);

  /// The kept components, in the order of their first pixel.
  std::size_t count() const { return selected_.size(); }
  const RunSums& sums(std::size_t i) const { return labels_[selected_[i]].sums; }
  Shape shape(std::size_t i) const { return shape_of(sums(i)); }
  /// x of the first run.
  int first_x(std::size_t i) const { return labels_[selected_[i]].first_x; }
  /// The runs of a component, by row, then x. The first call after a join sorts the runs of all components: few images
  /// need them.
  std::span<const Run> runs(std::size_t i);

  std::uint32_t too_small() const { return too_small_; }  ///< components under the least area
  std::uint32_t too_large() const { return too_large_; }
  std::uint32_t dropped() const { return dropped_; }  ///< components over `max_count`

 private:
  /// Statistics of the runs with one label; after a union, at the smaller label.
  struct Label {
    std::uint32_t parent;
    std::uint32_t runs;
    int first_x;  // of the first run
    RunSums sums;
  };

  std::uint32_t root_of(std::uint32_t label);
  std::uint32_t unite(std::uint32_t a, std::uint32_t b);
  void join_all();
  void choose(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count);
  void gather();

  std::vector<Run> runs_;
  std::vector<std::uint32_t> label_of_;  // by run
  std::vector<Label> labels_;
  std::vector<std::uint32_t> next_;       // by label: position of its next run
  std::vector<std::uint32_t> selected_;   // kept labels
  std::vector<std::uint32_t> first_run_;  // by kept component: index of its first run in sorted_
  std::vector<Run> sorted_;               // runs of the kept components, component by component, then all others
  std::size_t run_count_ = 0, label_count_ = 0;
  std::uint32_t too_small_ = 0, too_large_ = 0;
  std::uint32_t dropped_ = 0;
};

}  // namespace mocap::detect
