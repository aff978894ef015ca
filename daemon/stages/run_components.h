#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mocap::stages {

/// A stretch of bright pixels in one row: begin <= x < end.
struct Run {
  std::uint16_t y = 0;
  std::uint16_t begin = 0;
  std::uint16_t end = 0;
};

/// Joins the bright runs of an image to components: runs of neighbouring rows that touch, also by a corner.
///
/// Runs come in the order of rows and of x within a row. All memory is taken in the constructor; runs over its capacity
/// are counted and left out. One thread at a time.
///
/// Source: He, Chao, Suzuki, "A run-based two-scan labeling algorithm", IEEE Trans. Image Processing 17 (2008), with
/// union by the smaller index and path halving.
class RunComponents {
 public:
  explicit RunComponents(std::size_t max_runs);

  void clear();
  void add(Run run);

  /// Ends the image, and keeps the components whose area is within the bounds, the `max_count` largest at most. May be
  /// called once after the last `add`.
  void finish(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count);

  /// The components kept, in the order of their first pixel; each one's runs by row, then x.
  std::size_t count() const { return first_run_.empty() ? 0 : first_run_.size() - 1; }
  std::span<const Run> component(std::size_t i) const;

  std::uint32_t filtered() const { return filtered_; }  ///< components outside of the bounds
  std::uint32_t dropped() const { return dropped_; }    ///< components over `max_count`, and runs over capacity

 private:
  std::uint32_t root_of(std::uint32_t run);
  void join(std::uint32_t a, std::uint32_t b);
  void choose(std::uint32_t min_area_px2, std::uint32_t max_area_px2, std::size_t max_count);
  void gather();

  std::size_t max_runs_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint32_t> area_px2_;  // of the component, at its root; later its place among those kept
  std::size_t row_begin_ = 0;            // the runs of the row that is being added
  std::size_t above_ = 0;                // the runs of the row above from here on may still touch
  std::size_t above_end_ = 0;
  std::vector<std::uint32_t> kept_;  // roots
  std::vector<Run> sorted_;          // the runs of those kept, component by component
  std::vector<std::uint32_t> first_run_;
  std::uint32_t filtered_ = 0;
  std::uint32_t dropped_ = 0;
};

}  // namespace mocap::stages
