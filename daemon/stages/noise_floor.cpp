#include "stages/noise_floor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "stages/pixel_rows.h"

namespace mocap::stages {
namespace {

// Places of a few neighbours each, a cache line a place: 1024 pixels tell the background to a thirtieth of the noise.
constexpr int kAcross = 8;
constexpr int kDown = 8;
constexpr int kPlace_px = 16;
constexpr int kPlaces = kAcross * kDown;

struct Place {
  int x, y;
};

std::array<Place, kPlaces> places_of(const Image& image, int place_px) {
  std::array<Place, kPlaces> places;
  const int steps = image.width_px / place_px;
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      // Each row of places is shifted, so that no column of the sensor is read more than a few times.
      const int step = (2 * i + 1) * steps / (2 * kAcross) + 3 * j;
      places[static_cast<std::size_t>(j * kAcross + i)] = {step % steps * place_px,
                                                           (2 * j + 1) * image.height_px / (2 * kDown)};
    }
  }
  return places;
}

}  // namespace

NoiseFloorReader::NoiseFloorReader(std::uint32_t top) : histogram_(top + 1) {}

NoiseFloor NoiseFloorReader::read(const Image& image) {
  std::fill(histogram_.begin(), histogram_.end(), std::uint16_t{0});
  const int place_px = std::min(kPlace_px, image.width_px);
  const auto places = places_of(image, place_px);
  const std::size_t bytes = bytes_in_place(image.format);
  for (const Place& place : places) {
    const std::size_t at = static_cast<std::size_t>(place.y) * image.stride_bytes;
    if (bytes != 0) __builtin_prefetch(image.bytes.data() + at + static_cast<std::size_t>(place.x) * bytes);
  }
  std::array<std::uint16_t, kPlace_px> grey;
  for (const Place& place : places) {
    const auto pixels = std::span(grey).first(static_cast<std::size_t>(place_px));
    read_pixels(image, place.y, place.x, pixels);
    for (const std::uint16_t value : pixels) ++histogram_[value];
  }
  // Median and upper quartile bound what is background; mean and deviation of that are the floor.
  const int total = kPlaces * place_px;
  int seen = 0;
  std::size_t median = histogram_.size();
  std::size_t quartile = histogram_.size();
  for (std::size_t v = 0; v < histogram_.size() && quartile == histogram_.size(); ++v) {
    seen += histogram_[v];
    if (median == histogram_.size() && 2 * seen >= total) median = v;
    if (4 * seen >= 3 * total) quartile = v;
  }
  const double spread = 1.48 * std::max(1.0, static_cast<double>(quartile - median));
  const auto limit = std::min(histogram_.size() - 1, median + static_cast<std::size_t>(std::ceil(4.0 * spread)));
  std::uint64_t n = 0, sum = 0, squares = 0;
  for (std::size_t v = 0; v <= limit; ++v) {
    n += histogram_[v];
    sum += histogram_[v] * v;
    squares += histogram_[v] * v * v;
  }
  const double mean = static_cast<double>(sum) / static_cast<double>(n);
  const double variance = static_cast<double>(squares) / static_cast<double>(n) - mean * mean;
  // A twelfth: the deviation that rounding to whole levels has by itself.
  return {mean, std::sqrt(std::max(1.0 / 12.0, variance))};
}

}  // namespace mocap::stages
