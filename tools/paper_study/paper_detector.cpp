#include "paper_study/paper_detector.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"
#include "detect/components/run_components.h"
#include "detect/components/shape.h"

namespace mocap::paper_study {
namespace {

constexpr int kThreshold_grey = 230;
constexpr double kMinArea = 0.005e-2;  // fraction of the image area
constexpr double kMaxArea = 0.4e-2;

class PaperDetector final : public Detector {
 public:
  PaperDetector(int width_px, int height_px)
      : width_px_(width_px),
        height_px_(height_px),
        components_(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {}

  Detection detect(const Image& image) override {
    MOCAP_EXPECTS(image.format == PixelFormat::Mono8 && image.width_px == width_px_ && image.height_px == height_px_);
    std::size_t runs = 0;
    for (int y = 0; y < height_px_; ++y) runs = add_row(image, y, runs);
    const double pixels = static_cast<double>(width_px_) * height_px_;
    components_.join(runs, static_cast<std::uint32_t>(std::ceil(kMinArea * pixels)),
                     static_cast<std::uint32_t>(std::floor(kMaxArea * pixels)), kMaxBlobs);
    Detection found;
    found.dropped = components_.dropped();
    found.too_small = components_.too_small();
    found.too_large = components_.too_large();
    found.filtered = found.too_small + found.too_large;
    for (std::size_t i = 0; i < components_.count(); ++i) found.blobs.push_back(blob_of(components_.shape(i)));
    return found;
  }

 private:
  /// Appends the runs of the row after the first `runs` runs. Returns the new number of runs.
  std::size_t add_row(const Image& image, int y, std::size_t runs) {
    const std::byte* row = image.bytes.data() + static_cast<std::size_t>(y) * image.stride_bytes;
    const auto bright = [](std::byte grey) { return std::to_integer<int>(grey) >= kThreshold_grey; };
    const std::byte* const end = row + width_px_;
    for (const std::byte* at = std::find_if(row, end, bright); at != end;) {
      const std::byte* const dark = std::find_if_not(at, end, bright);
      components_.room()[runs++] = {static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(at - row),
                                    static_cast<std::uint16_t>(dark - row)};
      at = std::find_if(dark, end, bright);
    }
    return runs;
  }

  static Blob blob_of(const detect::Shape& shape) {
    Blob blob;
    blob.centroid.v = {shape.x, shape.y};
    blob.area_px2 = shape.area_px2;
    blob.sigma_px = 0.3;
    blob.peak = 1.0;
    return blob;
  }

  int width_px_, height_px_;
  detect::RunComponents components_;
};

}  // namespace

std::unique_ptr<Detector> make_paper_detector(int width_px, int height_px) {
  return std::make_unique<PaperDetector>(width_px, height_px);
}

}  // namespace mocap::paper_study
