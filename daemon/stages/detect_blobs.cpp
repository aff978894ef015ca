#include "stages/detect_blobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>

#include "stages/pixel_rows.h"
#include "stages/run_components.h"

namespace mocap::stages {
namespace {

constexpr int kMaxSize_px = 32767;
// What an image may bring at most; more is noise over the threshold, and the work stays bounded.
constexpr std::size_t kMaxRuns = std::size_t{1} << 18U;
// Samples along each side of the image from which background and noise are read: a thousand in all tell the background
// to a thirtieth of the noise.
constexpr int kSamples = 32;
// Noise alone passes 8 standard deviations less than once in 10^14 pixels; the second figure keeps clear of clean
// images.
constexpr double kThresholdOverNoise = 8.0;
constexpr double kThresholdOverBackground_grey = 20.0;
// Taken off before weighing: two standard deviations leave 2 % of the dark pixels some weight and cut little light.
constexpr double kLowOverNoise = 2.0;
// What the pixel grid leaves of the centroid of a disc of radius 1 px, in inverse proportion to the radius; measured on
// rendered discs of 2 to 8 px.
constexpr double kGridSigma_px = 0.016;
// A blob cut by the border: its centre may be off by about this share of its radius.
constexpr double kBorderSigma = 0.3;

/// In the format's own levels.
struct Levels {
  double background = 0.0;
  double noise = 0.0;  ///< standard deviation
};

template <class Pixels>
Levels read_levels(const Image& image, std::span<std::uint16_t> histogram) {
  std::fill(histogram.begin(), histogram.end(), std::uint16_t{0});
  const int across = std::min(kSamples, image.width_px);
  const int down = std::min(kSamples, image.height_px);
  const auto top = static_cast<std::uint32_t>(histogram.size() - 1);
  for (int j = 0; j < down; ++j) {
    const int y = (2 * j + 1) * image.height_px / (2 * down);
    const std::byte* row = image.bytes.data() + static_cast<std::size_t>(y) * image.stride_bytes;
    for (int i = 0; i < across; ++i) {
      // Each row of samples is shifted, so that no column of the sensor is read more than a few times.
      const int x = static_cast<int>(((2 * i + 1) * static_cast<std::int64_t>(image.width_px) / (2 * across) + 7 * j) %
                                     image.width_px);
      ++histogram[std::min(Pixels::value(row, x), top)];
    }
  }
  // Median and upper quartile bound what is background; mean and deviation of that are the levels.
  const int total = across * down;
  int seen = 0;
  std::size_t median = histogram.size();
  std::size_t quartile = histogram.size();
  for (std::size_t v = 0; v < histogram.size() && quartile == histogram.size(); ++v) {
    seen += histogram[v];
    if (median == histogram.size() && 2 * seen >= total) median = v;
    if (4 * seen >= 3 * total) quartile = v;
  }
  const double spread = 1.48 * std::max(1.0, static_cast<double>(quartile - median));
  const auto limit = std::min(histogram.size() - 1, median + static_cast<std::size_t>(std::ceil(4.0 * spread)));
  double n = 0.0;
  double sum = 0.0;
  double sum_squares = 0.0;
  for (std::size_t v = 0; v <= limit; ++v) {
    const double count = histogram[v];
    const double value = static_cast<double>(v);
    n += count;
    sum += count * value;
    sum_squares += count * value * value;
  }
  const double mean = sum / n;
  // A twelfth: the deviation that rounding to whole levels has by itself.
  return {mean, std::sqrt(std::max(1.0 / 12.0, sum_squares / n - mean * mean))};
}

/// What is added up over the pixels of a blob; x and y from the corner of its box.
struct Sums {
  double weight = 0.0, x = 0.0, y = 0.0;              // of the weights
  double n = 0.0, nx = 0.0, ny = 0.0, nxx_nyy = 0.0;  // of the pixels that weigh
  double area = 0.0, ax = 0.0, ay = 0.0;              // of the pixels over the threshold
  double axx = 0.0, ayy = 0.0, axy = 0.0;
  double saturated = 0.0;
  std::uint32_t peak = 0;
};

struct Cut {
  std::uint32_t threshold = 1;
  double low = 0.0;
  double noise = 0.0;
};

/// Measures one component on the image's pixels.
template <class Pixels>
class Measuring {
 public:
  Measuring(const Image& image, const Cut& cut, std::uint32_t top, int grow_px)
      : image_(image), cut_(cut), top_(top), grow_px_(grow_px) {}

  Blob measure(std::span<const Run> runs) const {
    int begin_x = image_.width_px;
    int end_x = 0;
    for (const Run& run : runs) {
      begin_x = std::min<int>(begin_x, run.begin);
      end_x = std::max<int>(end_x, run.end);
    }
    const int begin_y = runs.front().y;
    const int end_y = runs.back().y + 1;
    Sums sums;
    std::size_t near = 0;  // the first run that may still be within reach of the row
    for (int y = std::max(0, begin_y - grow_px_); y < std::min(image_.height_px, end_y + grow_px_); ++y) {
      while (near < runs.size() && runs[near].y < y - grow_px_) ++near;
      add_row(y, runs.subspan(near), begin_x, begin_y, sums);
    }
    Blob blob = blob_of(sums, begin_x, begin_y);
    blob.touches_border = begin_x == 0 || begin_y == 0 || end_x == image_.width_px || end_y == image_.height_px;
    if (blob.touches_border) blob.sigma_px = std::hypot(blob.sigma_px, kBorderSigma * std::sqrt(sums.area / M_PI));
    return blob;
  }

 private:
  /// Adds the row's share: the stretch that the runs near by reach when grown.
  void add_row(int y, std::span<const Run> near, int origin_x, int origin_y, Sums& sums) const {
    const std::byte* row = image_.bytes.data() + static_cast<std::size_t>(y) * image_.stride_bytes;
    int begin = image_.width_px;
    int end = 0;
    std::size_t own = 0;  // the first of the row's own runs, or where it would be
    for (std::size_t i = 0; i < near.size() && near[i].y <= y + grow_px_; ++i) {
      begin = std::min<int>(begin, near[i].begin - grow_px_);
      end = std::max<int>(end, near[i].end + grow_px_);
      if (near[i].y < y) own = i + 1;
    }
    begin = std::max(begin, 0);
    end = std::min(end, image_.width_px);
    const double dy = y - origin_y;
    for (int x = begin; x < end; ++x) {
      const std::uint32_t value = Pixels::value(row, x);
      const double dx = x - origin_x;
      if (value >= cut_.threshold) {
        while (own < near.size() && near[own].y == y && near[own].end <= x) ++own;
        const bool is_own = own < near.size() && near[own].y == y && near[own].begin <= x;
        if (!is_own) continue;  // the light of a neighbour
        sums.area += 1.0;
        sums.ax += dx;
        sums.ay += dy;
        sums.axx += dx * dx;
        sums.ayy += dy * dy;
        sums.axy += dx * dy;
        sums.peak = std::max(sums.peak, value);
        if (value >= top_) sums.saturated += 1.0;
      }
      const double weight = static_cast<double>(value) - cut_.low;
      if (weight <= 0.0) continue;
      sums.weight += weight;
      sums.x += weight * dx;
      sums.y += weight * dy;
      sums.n += 1.0;
      sums.nx += dx;
      sums.ny += dy;
      sums.nxx_nyy += dx * dx + dy * dy;
    }
  }

  Blob blob_of(const Sums& sums, int origin_x, int origin_y) const {
    Blob blob;
    const double x = sums.x / sums.weight;
    const double y = sums.y / sums.weight;
    blob.centroid = {{x + origin_x, y + origin_y}};
    // The weighted mean moves by (x_i - x) / weight for each level that pixel i is off; the mean of both axes.
    const double lever = sums.nxx_nyy - 2.0 * (x * sums.nx + y * sums.ny) + sums.n * (x * x + y * y);
    const double radius_px = std::sqrt(sums.area / M_PI);
    blob.sigma_px =
        std::hypot(cut_.noise * std::sqrt(std::max(0.0, 0.5 * lever)) / sums.weight, kGridSigma_px / radius_px);
    blob.area_px2 = sums.area;
    blob.peak = std::min(1.0, static_cast<double>(sums.peak) / top_);
    blob.saturated = sums.saturated / sums.area;
    add_shape(sums, blob);
    return blob;
  }

  /// The ratio and direction of the axes of the ellipse with the same inertia; a pixel is a square, not a point (1/12).
  static void add_shape(const Sums& sums, Blob& blob) {
    const double mx = sums.ax / sums.area;
    const double my = sums.ay / sums.area;
    const double xx = sums.axx / sums.area - mx * mx + 1.0 / 12.0;
    const double yy = sums.ayy / sums.area - my * my + 1.0 / 12.0;
    const double xy = sums.axy / sums.area - mx * my;
    const double mean = 0.5 * (xx + yy);
    const double half_range = std::hypot(0.5 * (xx - yy), xy);
    blob.roundness = std::sqrt(std::clamp((mean - half_range) / (mean + half_range), 0.0, 1.0));
    blob.axis_rad = 0.5 * std::atan2(2.0 * xy, xx - yy);
  }

  const Image& image_;
  const Cut& cut_;
  std::uint32_t top_;
  int grow_px_;
};

template <class Pixels>
class BlobDetector final : public Detector {
 public:
  /// `top` is the brightest value that the format has.
  BlobDetector(const DetectSettings& settings, int width_px, int height_px, std::uint32_t top)
      : settings_(settings),
        width_px_(width_px),
        height_px_(height_px),
        top_(top),
        histogram_(top + 1),
        components_(
            std::min(kMaxRuns, static_cast<std::size_t>(height_px) * static_cast<std::size_t>(width_px + 1) / 2 + 1)) {}

  Detection detect(const Image& image) override {
    Detection found;
    if (!is_whole(image)) return found;
    const Cut cut = cut_for(image);
    components_.clear();
    for (int y = 0; y < height_px_; ++y) {
      const std::byte* row = image.bytes.data() + static_cast<std::size_t>(y) * image.stride_bytes;
      for_each_run<Pixels>(row, width_px_, cut.threshold, [this, y](int begin, int end) {
        components_.add(
            {static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end)});
      });
    }
    const auto min_area = static_cast<std::uint32_t>(std::ceil(settings_.min_area_px2));
    const auto max_area = static_cast<std::uint32_t>(std::min(settings_.max_area_px2, 4.0e9));
    components_.finish(min_area, max_area, kMaxBlobs);
    found.dropped = components_.dropped();
    found.filtered = components_.filtered();
    const Measuring<Pixels> measuring(image, cut, top_, settings_.grow_px);
    for (std::size_t i = 0; i < components_.count(); ++i) {
      const Blob blob = measuring.measure(components_.component(i));
      if (blob.roundness < settings_.min_roundness) {
        ++found.filtered;
      } else {
        found.blobs.push_back(blob);
      }
    }
    return found;
  }

 private:
  bool is_whole(const Image& image) const {
    const std::size_t row_bytes = static_cast<std::size_t>(width_px_) * Pixels::kBytesPerPixel;
    return image.width_px == width_px_ && image.height_px == height_px_ && image.stride_bytes >= row_bytes &&
           image.bytes.size() >= row_bytes &&
           (image.bytes.size() - row_bytes) / image.stride_bytes >= static_cast<std::size_t>(height_px_ - 1);
  }

  Cut cut_for(const Image& image) {
    const Levels levels = read_levels<Pixels>(image, histogram_);
    const double per_grey = static_cast<double>(top_) / 255.0;
    const double automatic =
        levels.background + std::max(kThresholdOverNoise * levels.noise, kThresholdOverBackground_grey * per_grey);
    const double threshold = settings_.threshold ? *settings_.threshold * per_grey : automatic;
    Cut cut;
    cut.threshold = static_cast<std::uint32_t>(std::clamp(std::ceil(threshold - 1e-9), 1.0, static_cast<double>(top_)));
    const double low = settings_.low_threshold ? *settings_.low_threshold * per_grey
                                               : levels.background + kLowOverNoise * levels.noise;
    // Below the threshold, so that each component weighs something.
    cut.low = std::clamp(low, 0.0, static_cast<double>(cut.threshold) - 0.5);
    cut.noise = levels.noise;
    return cut;
  }

  DetectSettings settings_;
  int width_px_, height_px_;
  std::uint32_t top_;
  std::vector<std::uint16_t> histogram_;
  RunComponents components_;
};

std::optional<std::string> fault_of(const DetectSettings& settings) {
  const auto outside = [](double value, double low, double high) { return !(value >= low && value <= high); };
  if (settings.threshold && outside(*settings.threshold, 1.0, 255.0)) {
    return fmt::format("threshold is {}, expected 1 to 255", *settings.threshold);
  }
  if (settings.low_threshold && outside(*settings.low_threshold, 0.0, settings.threshold.value_or(255.0))) {
    return fmt::format("low_threshold is {}, expected 0 to the threshold", *settings.low_threshold);
  }
  if (!(settings.min_area_px2 >= 1.0 && settings.min_area_px2 <= 1e9)) {
    return fmt::format("min_area_px2 is {}, expected 1 or more", settings.min_area_px2);
  }
  if (!(settings.max_area_px2 >= settings.min_area_px2)) {
    return fmt::format("max_area_px2 is {}, expected min_area_px2 ({}) or more", settings.max_area_px2,
                       settings.min_area_px2);
  }
  if (outside(settings.min_roundness, 0.0, 1.0)) {
    return fmt::format("min_roundness is {}, expected 0 to 1", settings.min_roundness);
  }
  if (settings.grow_px < 0 || settings.grow_px > 8) {
    return fmt::format("grow_px is {}, expected 0 to 8", settings.grow_px);
  }
  return std::nullopt;
}

template <class Pixels>
std::unique_ptr<Detector> make(const DetectSettings& settings, int width_px, int height_px, std::uint32_t top) {
  return std::make_unique<BlobDetector<Pixels>>(settings, width_px, height_px, top);
}

}  // namespace

Result<std::unique_ptr<Detector>> make_blob_detector(const DetectSettings& settings, PixelFormat format, int width_px,
                                                     int height_px) {
  if (width_px < 1 || width_px > kMaxSize_px || height_px < 1 || height_px > kMaxSize_px) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("image size is {}x{} px, expected 1 to {} each", width_px, height_px, kMaxSize_px)};
  }
  if (const auto fault = fault_of(settings)) return Error{ErrorCode::InvalidArgument, "detect: " + *fault};
  switch (format) {
    case PixelFormat::Mono8:
    case PixelFormat::Nv12: return make<BytePixels>(settings, width_px, height_px, 255);
    case PixelFormat::Yuyv: return make<YuyvPixels>(settings, width_px, height_px, 255);
    case PixelFormat::Mono10: return make<DeepPixels>(settings, width_px, height_px, 1023);
    case PixelFormat::Mono12: return make<DeepPixels>(settings, width_px, height_px, 4095);
    case PixelFormat::Mono10p:
    case PixelFormat::Mono12p:
    case PixelFormat::Mjpeg: break;
  }
  return Error{ErrorCode::Unsupported,
               "detect: this pixel format cannot be read directly; set the camera to Mono8, Mono10 or Mono12, "
               "unpacked"};
}

}  // namespace mocap::stages
