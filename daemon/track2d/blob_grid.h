#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mocap::track2d {

/// The blobs of one image in square cells, about one blob a cell, for range searches. Building is linear in the number
/// of blobs; a search is linear in the cells and blobs within its radius. Allocates in the constructor only.
class BlobGrid {
 public:
  struct Entry {
    double x, y;  ///< px
    std::uint32_t index;
  };

  explicit BlobGrid(std::size_t max_blobs);

  /// Coordinates must be finite.
  void build(std::span<const Entry> entries);

  /// Calls `visit(index, squared distance)` for each entry no further than `reach_px` from `centre_px`.
  template <class Visit>
  void for_each_near(const Eigen::Vector2d& centre_px, double reach_px, Visit&& visit) const {
    const std::size_t left = column(centre_px.x() - reach_px);
    const std::size_t right = column(centre_px.x() + reach_px);
    const std::size_t bottom = row(centre_px.y() + reach_px);
    for (std::size_t y = row(centre_px.y() - reach_px); y <= bottom; ++y) {
      const std::uint32_t end = first_[y * columns_ + right + 1];
      for (std::uint32_t i = first_[y * columns_ + left]; i < end; ++i) {
        const double dx = sorted_[i].x - centre_px.x();
        const double dy = sorted_[i].y - centre_px.y();
        const double distance2 = dx * dx + dy * dy;
        if (distance2 <= reach_px * reach_px) visit(sorted_[i].index, distance2);
      }
    }
  }

 private:
  static std::size_t clamped(double cell, std::size_t count) {
    return cell > 0.0 ? std::min(static_cast<std::size_t>(std::min(cell, 1e6)), count - 1) : 0;
  }
  std::size_t column(double x) const { return clamped((x - x0_) * per_px_, columns_); }
  std::size_t row(double y) const { return clamped((y - y0_) * per_px_, rows_); }

  std::size_t max_blobs_;
  double x0_ = 0.0, y0_ = 0.0;
  double per_px_ = 1.0;  // cells
  std::size_t columns_ = 1, rows_ = 1;
  std::vector<std::uint32_t> first_;  // index of each cell's first entry, and one past the last
  std::vector<Entry> sorted_;
  std::vector<std::uint32_t> cell_;
};

}  // namespace mocap::track2d
