#include "detect/centroid/blob_measurer.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "detect/centroid/fit_disc.h"
#include "detect/centroid/waist.h"
#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace {

// What is darker than this many standard deviations over the background weighs nothing.
constexpr double kLowOverNoise = 2.0;
// The centre of a blob cut from another marker may be off by about this share of its radius.
constexpr double kSplitSigma = 0.04;
constexpr double kFittedSplitSigma = 0.002;
constexpr double kSharedLight_px = 1.0;  // how far from the cut the other one's light is
constexpr double kCutOffHeight = 1.5;
// Where the fit of a disc that the range cuts off begins.
constexpr double kStartEdge_px = 0.58;  // of a lens that blurs by half a pixel
constexpr double kWholeEdge_px = 0.66;  // what such an edge measures where the range cuts nothing off
constexpr double kSigmaOfEdge = 0.88;
constexpr double kFitRoundness = 0.7;  // what is longer is no disc
// What the grid leaves of such a disc's centroid without the fit, radius 1 px.
constexpr double kCutOffSigma_px = 0.028;
// Less round than that may be two discs.
constexpr double kRound = 0.85;

/// A fit of noise may end anywhere; a marker whose middle is out of its own pixels is none.
bool is_within(int width_px, int height_px, const SoftDisc& disc) {
  return disc.x >= -0.5 && disc.x <= width_px - 0.5 && disc.y >= -0.5 && disc.y <= height_px - 0.5;
}

Eigen::Vector2d axis_of(const Shape& shape) { return {std::cos(shape.axis_rad()), std::sin(shape.axis_rad())}; }

/// How far the brightest of the pixels on a disc's plateau is likely to be over it, in standard deviations.
double peak_over_plateau(double area_px2) {
  constexpr double kRim_px = 1.2;
  const double inside_px = std::max(0.0, std::sqrt(area_px2 / M_PI) - kRim_px);
  // The greatest of n normal deviates is on average near 0.85 sqrt(2 ln n), for n up to some hundred.
  return 0.85 * std::sqrt(2.0 * std::log(M_PI * inside_px * inside_px + 1.0));
}

}  // namespace

BlobMeter::BlobMeter(const DetectKernels& kernels, int grow_px, bool split_touching)
    : kernels_(kernels),
      grow_px_(grow_px),
      split_touching_(split_touching),
      pixels_(kMaxBox_px * kMaxBox_px),
      saved_(kMaxBox_px * kMaxBox_px),
      eraser_(std::max(grow_px, 1)),
      measured_(kMaxBlobs) {
  lights_.reserve(kMaxBlobs);
  for (std::size_t area = 0; area < peak_over_.size(); ++area) {
    peak_over_[area] = peak_over_plateau(static_cast<double>(area));
  }
}

void BlobMeter::measure(const Image& image, const Cut& cut, ImageComponents& components, std::size_t i,
                        const Shape& shape, double roundness) {
  const Window window = window_of(image, shape);
  Measured& measured = measured_[i];
  measured.clear();
  if (window.width_px > kMaxBox_px || window.height_px > kMaxBox_px) {
    // No marker is that large; where it is, to a share of its size, is all that can be told.
    Blob blob;
    blob.centroid = {{shape.x, shape.y}};
    blob.sigma_px = kSizeSigma * std::sqrt(shape.area_px2 / M_PI);
    blob.area_px2 = shape.area_px2;
    blob.peak = static_cast<double>(cut.threshold) / cut.top;
    blob.roundness = shape.roundness();
    blob.axis_rad = shape.axis_rad();
    measured.push_back(blob);
    return;
  }
  BoxSurvey seen = fetch(image, cut, window);
  if (seen.bright != static_cast<std::uint32_t>(shape.area_px2)) {
    eraser_.erase(components.runs(i), window.x, window.y, cut.threshold, box_, pixels_);
    seen = kernels_.survey(box_, cut.threshold);
  }
  const bool may_be_two = roundness < kRound && split_touching_;
  const Light light = weigh(cut, window, seen, roundness);
  if (!may_be_two && seen.peak < cut.top) {
    plain_.push_back(i);
    lights_.push_back(light);
    return;
  }
  WeighedLight found = tell_blob(cut, light);
  found.blob.axis_rad = shape.axis_rad();
  Waist waist;
  if (may_be_two) {
    waist = waist_of(cut, window, shape);
    if (waist.splits) {
      measured = split(cut, window, shape, waist);
      return;
    }
  }
  if (seen.peak >= cut.top) refine(cut, window, found);
  found.blob.merged = waist.doubtful;
  measured.push_back(found.blob);
}

void BlobMeter::finish(const Cut& cut, std::span<const Shape> shapes) {
  std::array<WeighedLight, kLightsAtOnce> found;
  for (std::size_t first = 0; first < lights_.size(); first += kLightsAtOnce) {
    const std::size_t count = std::min(kLightsAtOnce, lights_.size() - first);
    tell_blobs(cut, std::span(lights_).subspan(first, count), found);
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t component = plain_[first + k];
      found[k].blob.axis_rad = shapes[component].axis_rad();
      measured_[component].push_back(found[k].blob);
    }
  }
}

BlobMeter::Window BlobMeter::window_of(const Image& image, const Shape& shape) const {
  const int x = std::max(0, shape.begin_x - grow_px_), y = std::max(0, shape.begin_y - grow_px_);
  return {x, y, std::min(image.width_px, shape.end_x + grow_px_) - x,
          std::min(image.height_px, shape.end_y + grow_px_) - y};
}

void BlobMeter::prefetch(const Image& image, const Shape& shape) const {
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

BoxSurvey BlobMeter::fetch(const Image& image, const Cut& cut, const Window& window) {
  const int width = (window.width_px + kBoxStep_px - 1) / kBoxStep_px * kBoxStep_px;
  box_ = {pixels_.data(), width, window.height_px};
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(window.height_px);
  const std::size_t from = static_cast<std::size_t>(window.y) * image.stride_bytes + static_cast<std::size_t>(window.x);
  const bool bytes = bytes_in_place(image.format) == 1;
  if (bytes && from + (rows - 1) * image.stride_bytes + columns <= image.bytes.size()) {
    return kernels_.widen({image.bytes.data() + from, image.stride_bytes, window.width_px}, box_, pixels_.data(),
                          cut.threshold);
  }
  for (std::size_t row = 0; row < rows; ++row) {
    const auto line = std::span(pixels_).subspan(row * columns, columns);
    read_pixels(image, window.y + static_cast<int>(row), window.x,
                line.first(static_cast<std::size_t>(window.width_px)));
    std::fill(line.begin() + window.width_px, line.end(), std::uint16_t{0});
  }
  return kernels_.survey(box_, cut.threshold);
}

std::uint32_t BlobMeter::count_at_top(const Cut& cut, const BoxSurvey& seen) const {
  if (seen.peak < cut.top) return 0;
  const auto pixels =
      std::span(box_.pixels, static_cast<std::size_t>(box_.width_px) * static_cast<std::size_t>(box_.height_px));
  return static_cast<std::uint32_t>(
      std::ranges::count_if(pixels, [&cut](std::uint16_t grey) { return grey >= cut.top; }));
}

Light BlobMeter::weigh(const Cut& cut, const Window& window, const BoxSurvey& seen, double roundness) const {
  const double low = std::floor(cut.low.value_or(cut.background + kLowOverNoise * cut.noise));
  Weighing weighing;
  // Below the threshold, so that what is bright weighs something.
  weighing.low = static_cast<std::uint32_t>(std::clamp(low, 0.0, cut.threshold - 1.0));
  const double over =
      seen.peak >= cut.top ? 0.0 : cut.noise * peak_over_[std::min<std::size_t>(seen.bright, peak_over_.size() - 1)];
  weighing.span = static_cast<std::uint32_t>(std::max(1.0, seen.peak - over - weighing.low + 0.5));
  Light light;
  light.middle_x = window.x + box_.width_px / 2;
  light.middle_y = window.y + box_.height_px / 2;
  light.width_px = box_.width_px;
  light.height_px = box_.height_px;
  light.peak = seen.peak;
  light.bright = seen.bright;
  light.at_top = count_at_top(cut, seen);
  light.span = weighing.span;
  light.roundness = roundness;
  light.sums = kernels_.weigh(box_, weighing);
  return light;
}

// Of a disc that the range cuts off the rim is so steep that the grid spoils any weighted mean; a fit bears it.
void BlobMeter::refine(const Cut& cut, const Window& window, WeighedLight& weighed) {
  auto& [blob, radius_px, edge_px] = weighed;
  const bool fits = blob.roundness > kFitRoundness && fits_left_ > 0;
  fits_left_ -= fits ? 1 : 0;
  SoftDisc start;
  const double first_x = window.x, first_y = window.y;
  start.x = blob.centroid.v.x() - first_x;
  start.y = blob.centroid.v.y() - first_y;
  // The brighter the disc, the narrower is what the range leaves of its edge; half of the range is then the less of it.
  const double times_range = std::clamp(1.05 + 4.0 * (kWholeEdge_px - edge_px), 1.05, 3.0);
  start.height = times_range * (cut.top - cut.background);
  start.edge_px = std::max(kStartEdge_px, kSigmaOfEdge * edge_px);
  start.radius_px = std::max(0.5, radius_px - 0.6 * (times_range - 1.0) * start.edge_px);
  const DiscFitLevels levels{cut.top, cut.background, cut.noise};
  const auto fitted = fits ? fit_disc(box_, window.width_px, levels, start) : std::nullopt;
  if (!fitted || !is_within(window.width_px, window.height_px, fitted->disc)) {
    blob.sigma_px = std::hypot(blob.sigma_px, kCutOffSigma_px / std::sqrt(radius_px));
    return;
  }
  blob.centroid = {{fitted->disc.x + first_x, fitted->disc.y + first_y}};
  blob.sigma_px = fitted->sigma_px;
}

// What is left of a disc beside another one has its middle elsewhere; the rim that is left still tells of the whole.
bool BlobMeter::fit_side(const Cut& cut, const Window& window, const BoxSurvey& seen, Blob& blob) {
  const double radius_px = std::sqrt(blob.area_px2 / M_PI);
  const double first_x = window.x, first_y = window.y;
  SoftDisc start;
  start.x = blob.centroid.v.x() - first_x;
  start.y = blob.centroid.v.y() - first_y;
  start.radius_px = radius_px;
  start.edge_px = kStartEdge_px;
  start.height = (seen.peak >= cut.top ? kCutOffHeight : 1.0) * (seen.peak - cut.background);
  const DiscFitLevels levels{cut.top, cut.background, cut.noise};
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

Waist BlobMeter::waist_of(const Cut& cut, const Window& window, const Shape& shape) const {
  const Eigen::Vector2d middle(shape.x - window.x, shape.y - window.y);
  return find_waist(box_, cut.threshold, middle, axis_of(shape));
}

Measured BlobMeter::split(const Cut& cut, const Window& window, const Shape& shape, const Waist& waist) {
  Measured measured;
  const Eigen::Vector2d middle(shape.x - window.x, shape.y - window.y), axis = axis_of(shape);
  const auto pixels = static_cast<std::ptrdiff_t>(box_.width_px) * box_.height_px;
  std::copy_n(pixels_.begin(), pixels, saved_.begin());
  for (const bool far_side : {false, true}) {
    keep_side(pixels_, box_, middle, axis, waist.at_px, far_side);
    const BoxSurvey seen = kernels_.survey(box_, cut.threshold);
    if (seen.bright > 0) {
      const Eigen::Vector3d moments = moments_of(box_, cut.threshold);
      Shape side;
      side.xx = moments[0];
      side.yy = moments[1];
      side.xy = moments[2];
      Blob blob = tell_blob(cut, weigh(cut, window, seen, side.roundness())).blob;
      blob.axis_rad = side.axis_rad();
      keep_side(pixels_, box_, middle, axis, waist.at_px + (far_side ? kSharedLight_px : -kSharedLight_px), far_side);
      // A side that is long and no disc is two more.
      blob.merged = !fit_side(cut, window, seen, blob) && blob.roundness < kFitRoundness;
      measured.push_back(blob);
    }
    std::copy_n(saved_.begin(), pixels, pixels_.begin());
  }
  return measured;
}

}  // namespace mocap::detect
