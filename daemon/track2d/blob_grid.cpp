#include "track2d/blob_grid.h"

#include "base/expects.h"

namespace mocap::track2d {
namespace {

// Up to this number of blobs, one cell holds all.
constexpr std::size_t kMaxOneCell = 6;

}  // namespace

BlobGrid::BlobGrid(std::size_t max_blobs) : max_blobs_(max_blobs) {
  first_.assign(4 * max_blobs + 8, 0);  // rounding up adds up to two rows or columns of cells
  sorted_.reserve(max_blobs);
  cell_.reserve(max_blobs);
}

void BlobGrid::build(std::span<const Entry> entries) {
  MOCAP_EXPECTS(entries.size() <= max_blobs_);
  sorted_.resize(entries.size());
  columns_ = rows_ = 1;
  if (entries.size() <= kMaxOneCell) {
    std::copy(entries.begin(), entries.end(), sorted_.begin());
    first_[0] = 0;
    first_[1] = static_cast<std::uint32_t>(entries.size());
    return;
  }
  double x1 = x0_ = entries[0].x;
  double y1 = y0_ = entries[0].y;
  for (const Entry& entry : entries) {
    x0_ = std::min(x0_, entry.x);
    x1 = std::max(x1, entry.x);
    y0_ = std::min(y0_, entry.y);
    y1 = std::max(y1, entry.y);
  }
  const auto count = static_cast<double>(entries.size());
  const double width = x1 - x0_;
  const double height = y1 - y0_;
  per_px_ = 1.0 / std::max({std::sqrt(width * height / count), width / count, height / count, 1e-3});
  columns_ = std::min(static_cast<std::size_t>(width * per_px_) + 1, entries.size() + 1);
  rows_ = std::min(static_cast<std::size_t>(height * per_px_) + 1, (first_.size() - 2) / columns_);

  // Counting sort. Slot `cell + 2` counts the blobs of a cell; after the sort, slot `cell` has its first index.
  const std::size_t cells = columns_ * rows_;
  std::fill_n(first_.begin(), cells + 2, 0U);
  cell_.resize(entries.size());
  for (std::size_t i = 0; i < entries.size(); ++i) {
    cell_[i] = static_cast<std::uint32_t>(row(entries[i].y) * columns_ + column(entries[i].x));
    ++first_[cell_[i] + 2];
  }
  for (std::size_t c = 2; c < cells + 2; ++c) first_[c] += first_[c - 1];
  for (std::size_t i = 0; i < entries.size(); ++i) sorted_[first_[cell_[i] + 1]++] = entries[i];
}

}  // namespace mocap::track2d
