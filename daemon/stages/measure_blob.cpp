#include "stages/measure_blob.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "stages/pixel_rows.h"
#include "stages/touching_discs.h"

namespace mocap::stages {
namespace {

// The weights of the rim end above the brightest pixel by this many standard deviations over the radius in px: a large
// disc has a plateau whose noise is to be kept out, a small one is all rim. Tuned on rendered discs of 2 to 8 px.
constexpr double kPlateauOverPeak_px = 12.0;
// What the pixel grid leaves of the centroid of a disc of radius 1 px, in inverse proportion to the radius; measured on
// rendered discs of 2 to 8 px.
constexpr double kGridSigma_px = 0.008;
constexpr double kSharpGridSigma_px = 0.016;
// Width of the rim, as the integral of the squared slopes over it: 0.53 px where the edge is a step and only the pixels
// blur it, 0.70 px with a lens's blur of half a pixel.
// The noise of the plateau adds to either.
constexpr double kSharpEdge_px = 0.65;
constexpr double kSharpEdgePerRadius = 0.018;
// A blob cut by the border: its centre may be off by about this share of its radius. One cut from another marker: less.
constexpr double kBorderSigma = 0.3;
constexpr double kSplitSigma = 0.03;
// The slope of the weights, 6 u (1 - u) / span, of the whole numbers that the kernels add up.
constexpr double kSlopeOfSum = 6.0 * kFullWeight / (4.0 * kFullSlope);
// Less round than that may be two discs.
constexpr double kRound = 0.85;

}  // namespace

Shape shape_of(std::span<const Run> runs) {
  const Run& first = runs.front();
  int begin_x = first.begin, end_x = first.end;
  // From the first run's begin on. A run of `length` pixels about its middle, doubled to be whole.
  std::int64_t n = 0, x = 0, y = 0, xx = 0, cubes = 0, yy = 0, xy = 0;
  for (const Run& run : runs) {
    begin_x = std::min<int>(begin_x, run.begin);
    end_x = std::max<int>(end_x, run.end);
    const std::int64_t length = run.end - run.begin, middle = run.begin + run.end - 1 - 2 * first.begin;
    const std::int64_t dy = run.y - first.y, sum = length * middle;
    n += length;
    x += sum;
    y += dy * length;
    xx += sum * middle;
    cubes += length * length * length;
    yy += dy * dy * length;
    xy += dy * sum;
  }
  const double each = 1.0 / static_cast<double>(n);
  const auto of = [each](std::int64_t value) { return static_cast<double>(value) * each; };
  const double mean_x = 0.5 * of(x), mean_y = of(y);
  Shape shape;
  shape.begin_x = begin_x;
  shape.end_x = end_x;
  shape.begin_y = first.y;
  shape.end_y = runs.back().y + 1;
  shape.area_px2 = static_cast<double>(n);
  shape.x = mean_x + first.begin;
  shape.y = mean_y + first.y;
  // The pixels of a run spread by (length^2 - 1) / 12; a pixel that is a square makes up for the one.
  shape.xx = 0.25 * of(xx) + of(cubes) / 12.0 - mean_x * mean_x;
  shape.yy = of(yy) - mean_y * mean_y + 1.0 / 12.0;
  shape.xy = 0.5 * of(xy) - mean_x * mean_y;
  return shape;
}

double Shape::roundness() const {
  const double mean = 0.5 * (xx + yy);
  const double half_range = std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy);
  return std::sqrt(std::clamp((mean - half_range) / (mean + half_range), 0.0, 1.0));
}

double Shape::axis_rad() const { return 0.5 * std::atan2(2.0 * xy, xx - yy); }

BlobMeter::BlobMeter(const DetectKernels& kernels, int grow_px, bool split_touching)
    : kernels_(kernels),
      grow_px_(grow_px),
      split_touching_(split_touching),
      pixels_(kMaxBox_px * kMaxBox_px),
      saved_(kMaxBox_px * kMaxBox_px),
      own_(kMaxBox_px * kMaxBox_px) {}

Measured BlobMeter::measure(const Image& image, const Cut& cut, std::span<const Run> runs, const Shape& shape) {
  const Window window = window_of(image, shape);
  Measured measured;
  Blob blob;
  if (window.width_px > kMaxBox_px || window.height_px > kMaxBox_px) {
    // No marker is that large; where it is, to a share of its size, is all that can be told.
    blob.centroid = {{shape.x, shape.y}};
    blob.sigma_px = kBorderSigma * std::sqrt(shape.area_px2 / M_PI);
    blob.area_px2 = shape.area_px2;
    blob.peak = static_cast<double>(cut.threshold) / cut.top;
    blob.roundness = shape.roundness();
    blob.axis_rad = shape.axis_rad();
    measured.push_back(blob);
    return measured;
  }
  BoxSurvey seen = fetch(image, cut, window);
  if (seen.bright != static_cast<std::uint32_t>(shape.area_px2)) {
    erase_others(cut, runs, window);
    seen = kernels_.survey(box_, {cut.threshold, cut.top});
  }
  blob = weigh(cut, window, seen);
  blob.roundness = shape.roundness();
  blob.axis_rad = shape.axis_rad();
  if (blob.roundness < kRound && split_touching_) return split(cut, window, shape, blob);
  measured.push_back(blob);
  return measured;
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
                          {cut.threshold, cut.top});
  }
  for (std::size_t row = 0; row < rows; ++row) {
    const auto line = std::span(pixels_).subspan(row * columns, columns);
    read_pixels(image, window.y + static_cast<int>(row), window.x,
                line.first(static_cast<std::size_t>(window.width_px)));
    std::fill(line.begin() + window.width_px, line.end(), std::uint16_t{0});
  }
  return kernels_.survey(box_, {cut.threshold, cut.top});
}

// The light of a neighbour: its bright pixels, and what lies nearer to those than to the component's own.
void BlobMeter::erase_others(const Cut& cut, std::span<const Run> runs, const Window& window) {
  const int width = box_.width_px;
  const auto at = [width](int x, int y) { return static_cast<std::size_t>(y * width + x); };
  std::fill_n(own_.begin(), at(0, box_.height_px), std::uint8_t{0});
  for (const Run& run : runs) {
    std::fill_n(own_.begin() + static_cast<std::ptrdiff_t>(at(run.begin - window.x, run.y - window.y)),
                run.end - run.begin, std::uint8_t{1});
  }
  const auto bright = [&](int x, int y) { return pixels_[at(x, y)] >= cut.threshold; };
  // Squared distances to the nearest own and other bright pixel, within reach of the grown border.
  const int reach = std::max(grow_px_, 1);
  for (int y = 0; y < window.height_px; ++y) {
    for (int x = 0; x < window.width_px; ++x) {
      if (bright(x, y)) continue;
      int own = 2 * reach * reach + 1, other = own;
      for (int v = std::max(0, y - reach); v <= std::min(window.height_px - 1, y + reach); ++v) {
        for (int u = std::max(0, x - reach); u <= std::min(window.width_px - 1, x + reach); ++u) {
          if (!bright(u, v)) continue;
          int& nearest = own_[at(u, v)] != 0 ? own : other;
          nearest = std::min(nearest, (u - x) * (u - x) + (v - y) * (v - y));
        }
      }
      if (other <= own && other <= 2 * reach * reach) own_[at(x, y)] = 2;
    }
  }
  for (std::size_t i = 0; i < at(0, box_.height_px); ++i) {
    const bool others = own_[i] == 2 || (own_[i] == 0 && pixels_[i] >= cut.threshold);
    if (others) pixels_[i] = 0;
  }
}

Blob BlobMeter::weigh(const Cut& cut, const Window& window, const BoxSurvey& seen) const {
  const double low = std::floor(cut.low.value_or(cut.background));
  Weighing weighing;
  // Below the threshold, so that what is bright weighs something.
  weighing.low = static_cast<std::uint32_t>(std::clamp(low, 0.0, cut.threshold - 1.0));
  const double radius_px = std::sqrt(seen.bright / M_PI);
  const double room = seen.peak >= cut.top ? 0.0 : kPlateauOverPeak_px * cut.noise / radius_px;
  const double over = std::min(room, 0.5 * (seen.peak - weighing.low));
  const double plateau = std::min<double>(cut.top, seen.peak + over);
  weighing.span = static_cast<std::uint32_t>(std::max(1.0, plateau - weighing.low));
  BoxSums sums = kernels_.weigh_smoothly(box_, weighing);
  // Of an edge sharper than a pixel the smooth weights make too much; linear ones add up what each pixel got of it.
  const double edge_px = static_cast<double>(sums.slope2) / (2.0 * M_PI * radius_px * kFullSlope * kFullSlope);
  const bool sharp = edge_px < kSharpEdge_px + kSharpEdgePerRadius * radius_px;
  if (sharp) sums = kernels_.weigh_linearly(box_, weighing);
  const auto weight = static_cast<double>(sums.weight);
  const double x = static_cast<double>(sums.x) / weight, y = static_cast<double>(sums.y) / weight;
  Blob blob;
  blob.centroid = {{x + window.x + box_.width_px / 2, y + window.y + box_.height_px / 2}};
  blob.area_px2 = seen.bright;
  blob.peak = std::min(1.0, static_cast<double>(seen.peak) / cut.top);
  blob.saturated = static_cast<double>(seen.at_top) / seen.bright;
  // Pixel i, off by the noise, moves the centroid by slope_i (x_i - x) noise / weight; the mean of both axes. The
  // slopes balance about the middle as the weights do.
  const double lever = static_cast<double>(sums.xx + sums.yy) - (x * x + y * y) * static_cast<double>(sums.slope2);
  const double moved = cut.noise * kSlopeOfSum / weighing.span * std::sqrt(std::max(0.0, 0.5 * lever)) / weight;
  blob.sigma_px = std::hypot(moved, (sharp ? kSharpGridSigma_px : kGridSigma_px) / radius_px);
  return blob;
}

Measured BlobMeter::split(const Cut& cut, const Window& window, const Shape& shape, const Blob& whole) {
  Measured measured;
  const Eigen::Vector2d middle(shape.x - window.x, shape.y - window.y);
  const Eigen::Vector2d axis(std::cos(whole.axis_rad), std::sin(whole.axis_rad));
  const Waist waist = find_waist(box_, cut.threshold, middle, axis);
  if (!waist.splits) {
    measured.push_back(whole);
    measured.back().merged = waist.doubtful;
    return measured;
  }
  const auto pixels = static_cast<std::ptrdiff_t>(box_.width_px) * box_.height_px;
  std::copy_n(pixels_.begin(), pixels, saved_.begin());
  for (const bool far_side : {false, true}) {
    keep_side(pixels_, box_, middle, axis, waist.at_px, far_side);
    const BoxSurvey seen = kernels_.survey(box_, {cut.threshold, cut.top});
    if (seen.bright > 0) {
      Blob blob = weigh(cut, window, seen);
      const Eigen::Vector3d moments = moments_of(box_, cut.threshold);
      Shape side;
      side.xx = moments[0];
      side.yy = moments[1];
      side.xy = moments[2];
      blob.roundness = side.roundness();
      blob.axis_rad = side.axis_rad();
      blob.sigma_px = std::hypot(blob.sigma_px, kSplitSigma * std::sqrt(blob.area_px2 / M_PI));
      measured.push_back(blob);
    }
    std::copy_n(saved_.begin(), pixels, pixels_.begin());
  }
  return measured;
}

}  // namespace mocap::stages
