#include "detect/blob_detector.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/key_check.h"
#include "detect/centroid/blob_measurer.h"
#include "detect/components/image_components.h"
#include "detect/noise_floor.h"
#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace {

constexpr int kMaxSize_px = 32767;
// Standard deviation of the centre of a blob that the border or a mask cuts, as a share of the blob's radius.
constexpr double kCutSigma = 0.3;

class BlobDetector final : public Detector {
 public:
  BlobDetector(const DetectSettings& settings, const Image& like, std::span<const MaskPolygon> masks,
               const DetectKernels& kernels)
      : settings_(settings),
        like_(like),
        top_(top_of(like.format)),
        in_place_(bytes_in_place(like.format)),
        kernels_(kernels),
        floor_(top_),
        components_(like.width_px, like.height_px, masks),
        measurer_(kernels, settings.grow_px, settings.split_touching) {
    if (in_place_ == 0) row_.resize(static_cast<std::size_t>(like.width_px));
    one_row_.resize(static_cast<std::size_t>(like.width_px));
  }

  Detection detect(const Image& image) override {
    Detection found;
    if (image.width_px != like_.width_px || image.height_px != like_.height_px || image.format != like_.format ||
        !is_whole(image)) {
      return found;
    }
    if (in_place_ != 0) prefetch_parts(image);
    const GreyLevels grey_levels = grey_levels_for(image);
    found.threshold_grey = grey_levels.threshold * 255.0 / top_;
    found.noise_grey = grey_levels.noise * 255.0 / top_;
    found.background_grey = grey_levels.background * 255.0 / top_;
    scan(image, grey_levels);
    const auto min_area = static_cast<std::uint32_t>(std::ceil(settings_.min_area_px2));
    const auto max_area = static_cast<std::uint32_t>(std::min(settings_.max_area_px2, 4.0e9));
    components_.join(min_area, max_area, kMaxBlobs);
    found.rows_given_up = components_.rows_given_up();
    found.dropped = components_.dropped();
    found.too_small = components_.too_small();
    found.too_large = components_.too_large();
    shapes_.clear();
    measurer_.begin_image();
    for (std::size_t i = 0; i < components_.count(); ++i) {
      shapes_.push_back(components_.shape(i));
      roundness_[i] = shapes_.back().roundness();
      if (i < kPrefetchDistance) prefetch(image, i);
    }
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      if (i + kPrefetchDistance < shapes_.size()) prefetch(image, i + kPrefetchDistance);
      if (may_be_round(i)) measurer_.measure(image, grey_levels, components_, i, shapes_[i], roundness_[i]);
    }
    measurer_.finish(grey_levels, {shapes_.begin(), shapes_.end()});
    for (std::size_t i = 0; i < shapes_.size(); ++i) append_blobs(image, i, found);
    found.filtered = found.too_small + found.too_large + found.not_round + found.too_dim;
    return found;
  }

  double brightest_grey(const Image& image) override {
    if (image.width_px != like_.width_px || image.height_px != like_.height_px || image.format != like_.format ||
        !is_whole(image)) {
      return 0.0;
    }
    std::uint16_t brightest = 0;
    for (int y = 0; y < image.height_px; ++y) {
      read_pixels(image, y, 0, one_row_);
      for (std::size_t x = 0; x < one_row_.size(); ++x) {
        if (one_row_[x] > brightest && !components_.is_masked(static_cast<int>(x), y)) brightest = one_row_[x];
      }
    }
    return brightest * 255.0 / top_;
  }

 private:
  GreyLevels grey_levels_for(const Image& image) {
    const NoiseFloor floor = floor_.read(image);
    const double per_grey = static_cast<double>(top_) / 255.0;
    const double threshold = settings_.threshold ? *settings_.threshold * per_grey : marker_threshold(floor, top_);
    GreyLevels grey_levels;
    grey_levels.threshold =
        static_cast<std::uint32_t>(std::clamp(std::ceil(threshold - 1e-9), 1.0, static_cast<double>(top_)));
    grey_levels.top = top_;
    grey_levels.background = floor.background;
    grey_levels.noise = floor.noise;
    if (settings_.low_threshold) grey_levels.low = *settings_.low_threshold * per_grey;
    return grey_levels;
  }

  /// Prefetches the first pixels of each part of the scan while the noise floor waits for memory.
  void prefetch_parts(const Image& image) const {
    constexpr std::size_t kLines = 8, kLineBytes = 64;
    const std::size_t part_bytes = static_cast<std::size_t>(components_.room().part_rows()) * image.stride_bytes;
    for (std::size_t part = 0; part < BrightWords::kParts; ++part) {
      for (std::size_t line = 0; line < kLines; ++line) {
        const std::size_t at = part * part_bytes + line * kLineBytes;
        if (at < image.bytes.size()) __builtin_prefetch(image.bytes.data() + at);
      }
    }
  }

  void prefetch(const Image& image, std::size_t component) const {
    if (may_be_round(component)) measurer_.prefetch(image, shapes_[component]);
  }

  /// Writes the bright words of the image into the buffer of the components.
  void scan(const Image& image, const GreyLevels& grey_levels) {
    BrightWords& words = components_.room();
    words.clear();
    ScanRows rows;
    rows.width_px = image.width_px;
    rows.threshold = grey_levels.threshold;
    if (in_place_ != 0) {
      rows.bytes = image.bytes.data();
      rows.stride_bytes = image.stride_bytes;
      rows.rows = image.height_px;
      rows.kept = kept_bits(image.format);
      (in_place_ == 1 ? kernels_.scan_bytes : kernels_.scan_words)(rows, words);
    } else {
      rows.bytes = std::as_bytes(std::span(row_)).data();
      rows.rows = 1;
      for (rows.first_y = 0; rows.first_y < image.height_px; ++rows.first_y) {
        read_pixels(image, rows.first_y, 0, row_);
        kernels_.scan_words(rows, words);
      }
    }
  }

  void append_blobs(const Image& image, std::size_t component, Detection& found) {
    const Shape& shape = shapes_[component];
    if (!may_be_round(component)) {
      ++found.not_round;
      return;
    }
    const bool is_cut = shape.begin_x == 0 || shape.begin_y == 0 || shape.end_x == image.width_px ||
                        shape.end_y == image.height_px || components_.touches_mask(component);
    for (const Blob& blob : measurer_.blobs(component)) add(blob, is_cut, found);
  }

  void add(Blob blob, bool is_cut, Detection& found) const {
    if (blob.roundness < settings_.min_roundness) {
      ++found.not_round;
    } else if (blob.peak * 255.0 < settings_.min_peak_grey) {
      ++found.too_dim;
    } else {
      blob.touches_border = is_cut;
      if (is_cut) blob.sigma_px = std::hypot(blob.sigma_px, kCutSigma * std::sqrt(blob.area_px2 / M_PI));
      if (!found.blobs.try_push_back(blob)) ++found.dropped;
    }
  }

  bool may_be_round(std::size_t i) const { return roundness_[i] >= kTwoDiscRoundness * settings_.min_roundness; }

  // Number of components whose pixels are prefetched in advance: the first-level cache holds no more.
  static constexpr std::size_t kPrefetchDistance = 8;
  // Two touching discs are less round than each disc: a component above this share of min_roundness must be measured
  // before its roundness is known.
  static constexpr double kTwoDiscRoundness = 0.4;

  DetectSettings settings_;
  Image like_;
  std::uint32_t top_;
  std::size_t in_place_;
  const DetectKernels& kernels_;
  NoiseFloorReader floor_;
  ImageComponents components_;
  BoundedVector<Shape, kMaxBlobs> shapes_;
  std::array<double, kMaxBlobs> roundness_;  // by component
  BlobMeasurer measurer_;
  std::vector<std::uint16_t> row_;      // one unpacked row, for packed formats
  std::vector<std::uint16_t> one_row_;  // of brightest_grey
};

std::optional<std::string> fault_of(const DetectSettings& settings) {
  std::vector<KeyFault> faults = check_keys(settings);
  if (faults.empty()) faults = faults_of(settings);
  return faults.empty() ? std::nullopt : std::optional(faults.front().message);
}

}  // namespace

Result<std::unique_ptr<Detector>> make_blob_detector(const DetectSettings& settings, PixelFormat format, int width_px,
                                                     int height_px, std::span<const MaskPolygon> masks,
                                                     const DetectKernels* kernels) {
  if (width_px < 1 || width_px > kMaxSize_px || height_px < 1 || height_px > kMaxSize_px) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("image size is {}x{} px, expected 1 to {} each", width_px, height_px, kMaxSize_px)};
  }
  if (const auto fault = fault_of(settings)) return Error{ErrorCode::InvalidArgument, "detect: " + *fault};
  if (top_of(format) == 0) {
    return Error{ErrorCode::Unsupported, "detect: a compressed image has no rows of pixels; decode it first"};
  }
  Image like;
  like.width_px = width_px;
  like.height_px = height_px;
  like.format = format;
  return std::unique_ptr<Detector>(
      std::make_unique<BlobDetector>(settings, like, masks, kernels != nullptr ? *kernels : best_kernels()));
}

}  // namespace mocap::detect
