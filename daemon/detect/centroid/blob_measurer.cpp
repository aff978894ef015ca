#include "detect/centroid/blob_measurer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "detect/centroid/fit_disc.h"
#include "detect/centroid/waist.h"
#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace {

// Pixels darker than this many standard deviations over the background have weight 0.
constexpr double kLowOverNoise = 2.0;
// Standard deviation of the centre of a blob that was split from another marker, as a share of the blob's radius:
// without and with a fit of its rim.
constexpr double kSplitSigma = 0.04;
constexpr double kFittedSplitSigma = 0.002;
constexpr double kSplitMargin_px = 1.0;  // the light of the other marker reaches this far across the cut
constexpr double kClippedHeight = 1.5;   // initial height of a saturated disc, in multiples of the range
// Initial values of the fit of a saturated disc.
constexpr double kInitialEdge_px = 0.58;    // blur of a lens with a standard deviation of half a pixel
constexpr double kUnclippedEdge_px = 0.66;  // measured edge width with that blur and without saturation
constexpr double kSigmaOfEdge = 0.88;       // standard deviation of the blur over the measured edge width
constexpr double kFitRoundness = 0.7;       // a less round blob is not a disc
// Standard deviation of the weighted centroid of a saturated disc of radius 1 px, from the pixel grid.
constexpr double kClippedSigma_px = 0.028;
// A less round component may be two discs.
constexpr double kMinSingleRoundness = 0.85;

/// Whether the centre of a disc lies inside its window. A fit to noise may end anywhere.
bool is_within(int width_px, int height_px, const SoftDisc& disc) {
  return disc.x >= -0.5 && disc.x <= width_px - 0.5 && disc.y >= -0.5 && disc.y <= height_px - 0.5;
}

Eigen::Vector2d axis_of(const Shape& shape) { return {std::cos(shape.axis_rad()), std::sin(shape.axis_rad())}; }

/// The expected excess of the brightest pixel of a disc over the disc's plateau, in standard deviations of the noise.
double peak_over_plateau(double area_px2) {
  constexpr double kPlateauMargin_px = 1.2;
  const double inside_px = std::max(0.0, std::sqrt(area_px2 / M_PI) - kPlateauMargin_px);
  // The expected maximum of n normal deviates is about 0.85 sqrt(2 ln n), for n up to some hundred.
  return 0.85 * std::sqrt(2.0 * std::log(M_PI * inside_px * inside_px + 1.0));
}

}  // namespace

BlobMeasurer::BlobMeasurer(const DetectKernels& kernels, int grow_px, bool split_touching)
    : kernels_(kernels),
      grow_px_(grow_px),
      split_touching_(split_touching),
      pixels_(kMaxBox_px * kMaxBox_px),
      saved_(kMaxBox_px * kMaxBox_px),
      eraser_(std::max(grow_px, 1)),
      component_blobs_(kMaxBlobs) {
  intensity_sums_.reserve(kMaxBlobs);
  for (std::size_t area = 0; area < plateau_excess_.size(); ++area) {
    plateau_excess_[area] = peak_over_plateau(static_cast<double>(area));
  }
}

void BlobMeasurer::measure(const Image& image, const GreyLevels& grey_levels, ImageComponents& components,
                           std::size_t i, const Shape& shape, double roundness) {
  const Window window = window_of(image, shape);
  ComponentBlobs& measured = component_blobs_[i];
  measured.clear();
  if (window.width_px > kMaxBox_px || window.height_px > kMaxBox_px) {
    // No marker is that large: the blob gets the centre of gravity, with a standard deviation proportional to its size.
    Blob blob;
    blob.centroid = {{shape.x, shape.y}};
    blob.sigma_px = kUnknownCentroidSigma * std::sqrt(shape.area_px2 / M_PI);
    blob.area_px2 = shape.area_px2;
    blob.peak = static_cast<double>(grey_levels.threshold) / grey_levels.top;
    blob.roundness = shape.roundness();
    blob.axis_rad = shape.axis_rad();
    measured.push_back(blob);
    return;
  }
  BoxStatistics statistics = fetch(image, grey_levels, window);
  if (statistics.bright != static_cast<std::uint32_t>(shape.area_px2)) {
    eraser_.erase(components.runs(i), window.x, window.y, grey_levels.threshold, box_, pixels_);
    statistics = kernels_.survey(box_, grey_levels.threshold);
  }
  const bool may_be_two = roundness < kMinSingleRoundness && split_touching_;
  const IntensitySums intensity = weigh(grey_levels, window, statistics, roundness);
  if (!may_be_two && statistics.peak < grey_levels.top) {
    deferred_components_.push_back(i);
    intensity_sums_.push_back(intensity);
    return;
  }
  MeasuredBlob found = measure_blob(grey_levels, intensity);
  found.blob.axis_rad = shape.axis_rad();
  Waist waist;
  if (may_be_two) {
    waist = waist_of(grey_levels, window, shape);
    if (waist.splits) {
      measured = split(grey_levels, window, shape, waist);
      return;
    }
  }
  if (statistics.peak >= grey_levels.top) refine(grey_levels, window, found);
  found.blob.merged = waist.doubtful;
  measured.push_back(found.blob);
}

void BlobMeasurer::finish(const GreyLevels& grey_levels, std::span<const Shape> shapes) {
  std::array<MeasuredBlob, kBlobLanes> found;
  for (std::size_t first = 0; first < intensity_sums_.size(); first += kBlobLanes) {
    const std::size_t count = std::min(kBlobLanes, intensity_sums_.size() - first);
    measure_blobs(grey_levels, std::span(intensity_sums_).subspan(first, count), found);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t component = deferred_components_[first + k];
      found[k].blob.axis_rad = shapes[component].axis_rad();
      component_blobs_[component].push_back(found[k].blob);
    }
  }
}

BlobMeasurer::Window BlobMeasurer::window_of(const Image& image, const Shape& shape) const {
  const int x = std::max(0, shape.begin_x - grow_px_), y = std::max(0, shape.begin_y - grow_px_);
  return {x, y, std::min(image.width_px, shape.end_x + grow_px_) - x,
          std::min(image.height_px, shape.end_y + grow_px_) - y};
}

void BlobMeasurer::prefetch(const Image& image, const Shape& shape) const {
  const std::size_t bytes = bytes_in_place(image.format);
  if (bytes == 0) return;
  const Window window = window_of(image, shape);
  const std::byte* row = image.bytes.data() + static_cast<std::size_t>(window.y) * image.stride_bytes +
                         static_cast<std::size_t>(window.x) * bytes;
  const std::size_t last = static_cast<std::size_t>(window.width_px) * bytes - 1;
  for (int y = 0; y < std::min(window.height_px, kMaxBox_px); ++y) {
    __builtin_prefetch(row);
    __builtin_prefetch(row + last);
    row += image.stride_bytes;
  }
}

BoxStatistics BlobMeasurer::fetch(const Image& image, const GreyLevels& grey_levels, const Window& window) {
  const int width = (window.width_px + kBoxStep_px - 1) / kBoxStep_px * kBoxStep_px;
  box_ = {pixels_.data(), width, window.height_px};
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(window.height_px);
  const std::size_t from = static_cast<std::size_t>(window.y) * image.stride_bytes + static_cast<std::size_t>(window.x);
  const bool bytes = bytes_in_place(image.format) == 1;
  if (bytes && from + (rows - 1) * image.stride_bytes + columns <= image.bytes.size()) {
    return kernels_.widen({image.bytes.data() + from, image.stride_bytes, window.width_px}, box_, pixels_.data(),
                          grey_levels.threshold);
  }
  for (std::size_t row = 0; row < rows; ++row) {
    const auto line = std::span(pixels_).subspan(row * columns, columns);
    read_pixels(image, window.y + static_cast<int>(row), window.x,
                line.first(static_cast<std::size_t>(window.width_px)));
    std::fill(line.begin() + window.width_px, line.end(), std::uint16_t{0});
  }
  return kernels_.survey(box_, grey_levels.threshold);
}

std::uint32_t BlobMeasurer::count_at_top(const GreyLevels& grey_levels, const BoxStatistics& statistics) const {
  if (statistics.peak < grey_levels.top) return 0;
  const auto pixels =
      std::span(box_.pixels, static_cast<std::size_t>(box_.width_px) * static_cast<std::size_t>(box_.height_px));
  return static_cast<std::uint32_t>(
      std::ranges::count_if(pixels, [&grey_levels](std::uint16_t grey) { return grey >= grey_levels.top; }));
}

IntensitySums BlobMeasurer::weigh(const GreyLevels& grey_levels, const Window& window, const BoxStatistics& statistics,
                                  double roundness) const {
  const double low = std::floor(grey_levels.low.value_or(grey_levels.background + kLowOverNoise * grey_levels.noise));
  IntensityRamp weighing;
  // `low` is below the threshold, so that each bright pixel has a weight above 0.
  weighing.low = static_cast<std::uint32_t>(std::clamp(low, 0.0, grey_levels.threshold - 1.0));
  const double over =
      statistics.peak >= grey_levels.top
          ? 0.0
          : grey_levels.noise * plateau_excess_[std::min<std::size_t>(statistics.bright, plateau_excess_.size() - 1)];
  weighing.span = static_cast<std::uint32_t>(std::max(1.0, statistics.peak - over - weighing.low + 0.5));
  IntensitySums intensity;
  intensity.middle_x = window.x + box_.width_px / 2;
  intensity.middle_y = window.y + box_.height_px / 2;
  intensity.begin_x = window.x;
  intensity.begin_y = window.y;
  intensity.end_x = window.x + window.width_px;
  intensity.end_y = window.y + window.height_px;
  intensity.peak = statistics.peak;
  intensity.bright = statistics.bright;
  intensity.at_top = count_at_top(grey_levels, statistics);
  intensity.span = weighing.span;
  intensity.roundness = roundness;
  intensity.sums = kernels_.weigh(box_, weighing);
  return intensity;
}

// Replaces the weighted centroid of a saturated disc by a fit of its rim. The rim of a saturated disc is so steep that
// the pixel grid biases every weighted mean.
void BlobMeasurer::refine(const GreyLevels& grey_levels, const Window& window, MeasuredBlob& weighed) {
  auto& [blob, radius_px, edge_px] = weighed;
  const bool fits = blob.roundness > kFitRoundness && fits_left_ > 0;
  fits_left_ -= fits ? 1 : 0;
  SoftDisc start;
  const double first_x = window.x, first_y = window.y;
  start.x = blob.centroid.v.x() - first_x;
  start.y = blob.centroid.v.y() - first_y;
  // The brighter the disc, the narrower the visible part of its edge: the edge width gives the initial height of the
  // disc over the range.
  const double times_range = std::clamp(1.05 + 4.0 * (kUnclippedEdge_px - edge_px), 1.05, 3.0);
  start.height = times_range * (grey_levels.top - grey_levels.background);
  start.edge_px = std::max(kInitialEdge_px, kSigmaOfEdge * edge_px);
  start.radius_px = std::max(0.5, radius_px - 0.6 * (times_range - 1.0) * start.edge_px);
  const DiscFitLevels levels{grey_levels.top, grey_levels.background, grey_levels.noise};
  const auto fitted = fits ? fit_disc(box_, window.width_px, levels, start) : std::nullopt;
  if (!fitted || !is_within(window.width_px, window.height_px, fitted->disc)) {
    blob.sigma_px = std::hypot(blob.sigma_px, kClippedSigma_px / std::sqrt(radius_px));
    return;
  }
  blob.centroid = {{fitted->disc.x + first_x, fitted->disc.y + first_y}};
  blob.sigma_px = fitted->sigma_px;
}

// Fits one of two split discs to the part of its rim on its own side: the centroid of that part is not the centre of
// the disc. Returns whether the fit succeeded.
bool BlobMeasurer::fit_side(const GreyLevels& grey_levels, const Window& window, const BoxStatistics& statistics,
                            Blob& blob) {
  const double radius_px = std::sqrt(blob.area_px2 / M_PI);
  const double first_x = window.x, first_y = window.y;
  SoftDisc start;
  start.x = blob.centroid.v.x() - first_x;
  start.y = blob.centroid.v.y() - first_y;
  start.radius_px = radius_px;
  start.edge_px = kInitialEdge_px;
  start.height =
      (statistics.peak >= grey_levels.top ? kClippedHeight : 1.0) * (statistics.peak - grey_levels.background);
  const DiscFitLevels levels{grey_levels.top, grey_levels.background, grey_levels.noise};
  const auto fitted = fits_left_-- > 0 ? fit_disc(box_, window.width_px, levels, start) : std::nullopt;
  if (!fitted || !is_within(window.width_px, window.height_px, fitted->disc)) {
    fits_left_ = std::max(fits_left_, 0);
    blob.sigma_px = std::hypot(blob.sigma_px, kSplitSigma * radius_px);
    return false;
  }
  blob.centroid = {{fitted->disc.x + first_x, fitted->disc.y + first_y}};
  blob.sigma_px = std::hypot(fitted->sigma_px, kFittedSplitSigma * radius_px);
  return true;
}

Waist BlobMeasurer::waist_of(const GreyLevels& grey_levels, const Window& window, const Shape& shape) const {
  const Eigen::Vector2d middle(shape.x - window.x, shape.y - window.y);
  return find_waist(box_, grey_levels.threshold, middle, axis_of(shape));
}

ComponentBlobs BlobMeasurer::split(const GreyLevels& grey_levels, const Window& window, const Shape& shape,
                                   const Waist& waist) {
  ComponentBlobs measured;
  const Eigen::Vector2d middle(shape.x - window.x, shape.y - window.y), axis = axis_of(shape);
  const auto pixels = static_cast<std::ptrdiff_t>(box_.width_px) * box_.height_px;
  std::copy_n(pixels_.begin(), pixels, saved_.begin());
  for (const bool far_side : {false, true}) {
    keep_side(pixels_, box_, middle, axis, waist.at_px, far_side);
    const BoxStatistics statistics = kernels_.survey(box_, grey_levels.threshold);
    if (statistics.bright > 0) {
      const Eigen::Vector3d moments = moments_of(box_, grey_levels.threshold);
      Shape side;
      side.xx = moments[0];
      side.yy = moments[1];
      side.xy = moments[2];
      Blob blob = measure_blob(grey_levels, weigh(grey_levels, window, statistics, side.roundness())).blob;
      blob.axis_rad = side.axis_rad();
      keep_side(pixels_, box_, middle, axis, waist.at_px + (far_side ? kSplitMargin_px : -kSplitMargin_px), far_side);
      // A side that is elongated and does not fit a disc may be two markers itself.
      blob.merged = !fit_side(grey_levels, window, statistics, blob) && blob.roundness < kFitRoundness;
      measured.push_back(blob);
    }
    std::copy_n(saved_.begin(), pixels, pixels_.begin());
  }
  return measured;
}

}  // namespace mocap::detect
