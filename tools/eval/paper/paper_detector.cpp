#include "eval/paper/paper_detector.h"

#include <algorithm>
#include <vector>

#include "base/expects.h"

namespace mocap::eval::paper {
namespace {

constexpr int kThreshold_grey = 230;
constexpr double kMinArea = 0.005e-2;  // shares of the image
constexpr double kMaxArea = 0.4e-2;

/// A stretch of bright pixels in a row: begin <= x < end.
struct Stretch {
  int y, begin, end;
  std::size_t parent;  // index of one that it hangs together with, not behind its own
};

class PaperDetector final : public Detector {
 public:
  PaperDetector(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}

  Detection detect(const Image& image) override {
    MOCAP_EXPECTS(image.format == PixelFormat::Mono8 && image.width_px == width_px_ && image.height_px == height_px_);
    stretches_.clear();
    std::size_t above = 0;  // the first stretch of the row above
    for (int y = 0; y < height_px_; ++y) {
      const std::size_t row = stretches_.size();
      add_row(image, y);
      join(above, row);
      above = row;
    }
    return gather();
  }

 private:
  void add_row(const Image& image, int y) {
    const std::byte* row = image.bytes.data() + static_cast<std::size_t>(y) * image.stride_bytes;
    const auto bright = [](std::byte grey) { return std::to_integer<int>(grey) >= kThreshold_grey; };
    const std::byte* const end = row + width_px_;
    for (const std::byte* at = std::find_if(row, end, bright); at != end;) {
      const std::byte* const dark = std::find_if_not(at, end, bright);
      stretches_.push_back({y, static_cast<int>(at - row), static_cast<int>(dark - row), stretches_.size()});
      at = std::find_if(dark, end, bright);
    }
  }

  std::size_t root_of(std::size_t i) const {
    while (stretches_[i].parent != i) i = stretches_[i].parent;
    return i;
  }

  /// Joins the stretches of the last row, which begins at `row`, to those above that they touch, also by a corner.
  void join(std::size_t above, std::size_t row) {
    for (std::size_t i = row; i < stretches_.size(); ++i) {
      for (std::size_t j = above; j < row; ++j) {
        if (stretches_[j].begin > stretches_[i].end || stretches_[i].begin > stretches_[j].end) continue;
        const std::size_t a = root_of(i), b = root_of(j);
        stretches_[std::max(a, b)].parent = std::min(a, b);
      }
    }
  }

  Detection gather() {
    sums_.assign(stretches_.size(), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < stretches_.size(); ++i) {
      const Stretch& stretch = stretches_[i];
      const double length = stretch.end - stretch.begin;
      sums_[root_of(i)] += length * Eigen::Vector3d(0.5 * (stretch.begin + stretch.end - 1), stretch.y, 1.0);
    }
    const double pixels = static_cast<double>(width_px_) * height_px_;
    Detection found;
    for (const Eigen::Vector3d& sum : sums_) {
      if (sum.z() == 0.0) continue;
      Blob blob;
      blob.area_px2 = sum.z();
      blob.centroid.v = sum.head<2>() / sum.z();
      blob.sigma_px = 0.3;
      blob.peak = 1.0;
      if (blob.area_px2 < kMinArea * pixels || blob.area_px2 > kMaxArea * pixels) {
        ++found.filtered;
      } else if (!found.blobs.try_push_back(blob)) {
        ++found.dropped;
      }
    }
    return found;
  }

  int width_px_, height_px_;
  std::vector<Stretch> stretches_;
  std::vector<Eigen::Vector3d> sums_;  // of x, y and area, at each component's root
};

}  // namespace

std::unique_ptr<Detector> make_paper_detector(int width_px, int height_px) {
  return std::make_unique<PaperDetector>(width_px, height_px);
}

}  // namespace mocap::eval::paper
