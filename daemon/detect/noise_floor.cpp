#include "detect/noise_floor.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>

#include "detect/pixel_rows.h"

namespace mocap::detect {
namespace {

// 512 pixels give the background to 1/20 of the noise and the noise to 3 %. The pixels of a place lie in one or two
// cache lines, and each place costs one wait for memory.
constexpr std::size_t kPlaces = 32;
constexpr std::size_t kPlace_px = 16;
constexpr std::size_t kPixels = kPlaces * kPlace_px;
constexpr int kLevels = 256;  // of the histogram, for all formats

// Gaussian noise exceeds 8 standard deviations in fewer than one of 10^14 pixels. The second bound keeps a distance in
// images that have almost no noise.
constexpr double kThresholdOverNoise = 8.0;
constexpr double kThresholdOverBackground = 20.0 / 255.0;

// Levels per step of the search for the brightest level of the background. The search needs no finer resolution,
// because the quartiles are taken from single levels.
constexpr int kSearchStep = 4;

// The upper quartile of a Gaussian lies 1/1.48 standard deviations over the median.
constexpr double kSigmaOfQuartile = 1.48;
constexpr double kLimit_sigmas = 4.0;

// A place is clutter if more than half of its pixels lie this many quartile distances over the median. A uniform
// distribution ends at 2, so a gradient over the whole image loses no place. A pixel of Gaussian noise exceeds 2 with
// probability 0.089, and 9 of 16 pixels do with probability 2e-6.
constexpr int kClutter_quartiles = 2;

struct Place {
  int x, y;
};
using Places = std::array<Place, kPlaces>;

/// Gives each place a row of its own and a column in steps of the golden section, so that no regular pattern in the
/// image meets all places.
Places places_of(const Image& image) {
  constexpr int kGolden = 40503;  // of 65536
  constexpr int kWidth_px = static_cast<int>(kPlace_px), kCount = static_cast<int>(kPlaces);
  Places places;
  const int steps = std::max(1, image.width_px / kWidth_px);
  for (int k = 0; k < kCount; ++k) {
    const int across = k * kGolden & 0xFFFF;
    places[static_cast<std::size_t>(k)] = {(across * steps >> 16) * kWidth_px,
                                           (2 * k + 1) * image.height_px / (2 * kCount)};
  }
  return places;
}

/// Asks for the pixels of all places at once, so that the places wait for memory together.
void prefetch(const Image& image, const Places& places) {
  const std::size_t pixel_bytes = bytes_in_place(image.format);
  if (pixel_bytes == 0) return;
  for (const Place& place : places) {
    const std::size_t at = static_cast<std::size_t>(place.y) * image.stride_bytes;
    __builtin_prefetch(image.bytes.data() + at + static_cast<std::size_t>(place.x) * pixel_bytes);
  }
}

using Bytes = std::array<std::uint8_t, kPixels>;   // place after place
using Words = std::array<std::uint16_t, kPixels>;  // the same in the levels of the format

/// Reads places of one-byte pixels in a fifth of the time of read_pixels.
Bytes read_bytes(const Image& image, const Places& places) {
  Bytes bytes;
  std::uint8_t* to = bytes.data();
  for (const Place& place : places) {
    const std::size_t at = static_cast<std::size_t>(place.y) * image.stride_bytes + static_cast<std::size_t>(place.x);
    std::memcpy(to, image.bytes.data() + at, kPlace_px);
    to += kPlace_px;
  }
  return bytes;
}

/// Reads places of any format. A row shorter than a place is repeated.
Words read_words(const Image& image, const Places& places) {
  const std::size_t width_px = std::min(kPlace_px, static_cast<std::size_t>(image.width_px));
  Words words;
  std::uint16_t* to = words.data();
  for (const Place& place : places) {
    read_pixels(image, place.y, place.x, {to, width_px});
    for (std::size_t i = width_px; i < kPlace_px; ++i) to[i] = to[i - width_px];
    to += kPlace_px;
  }
  return words;
}

/// Histogram of 8-bit levels.
class Histogram {
 public:
  explicit Histogram(const Bytes& bytes) {
    // Neighbouring pixels are alike, and increments of one counter wait for each other: four tables take turns.
    std::array<std::array<std::uint16_t, kLevels>, 4> tables{};
    for (std::size_t i = 0; i < kPixels; ++i) ++tables[i % 4][bytes[i]];
    for (std::size_t level = 0; level < kLevels; ++level) {
      counts_[level] =
          static_cast<std::uint16_t>(tables[0][level] + tables[1][level] + tables[2][level] + tables[3][level]);
    }
  }

  int of(int level) const { return counts_[static_cast<std::size_t>(level)]; }
  void remove(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t level : bytes) --counts_[level];
  }

 private:
  std::array<std::uint16_t, kLevels> counts_;
};

/// Sums over pixels of their difference from some level, and of its square.
struct FloorSums {
  std::int64_t n = 0, sum = 0, squares = 0;

  void add(std::int64_t count, std::int64_t difference) {
    n += count;
    sum += count * difference;
    squares += count * difference * difference;
  }
};

NoiseFloor floor_of(const FloorSums& sums, int from) {
  const double mean = static_cast<double>(sums.sum) / static_cast<double>(sums.n);
  const double variance = static_cast<double>(sums.squares) / static_cast<double>(sums.n) - mean * mean;
  // Rounding to whole levels alone has the variance 1/12.
  return {from + mean, std::sqrt(std::max(1.0 / 12.0, variance))};
}

/// Step 1: returns the brightest level of the background.
int background_end(const Histogram& histogram) {
  constexpr double kTop = kLevels - 1;
  FloorSums sums;
  int end = kLevels - 1;
  double most_found = 0.0;
  for (int begin = 0; sums.n < static_cast<std::int64_t>(kPixels); begin += kSearchStep) {
    const std::int64_t before = sums.n;
    for (int level = begin; level < begin + kSearchStep; ++level) sums.add(histogram.of(level), level);
    if (sums.n == before) continue;
    const double threshold = marker_threshold(floor_of(sums, 0), kTop) / kTop;
    const double found = static_cast<double>(sums.n) * (1.0 - threshold * threshold);
    if (found <= most_found) continue;
    most_found = found;
    end = begin + kSearchStep - 1;
  }
  return end;
}

struct Quartiles {
  int median, upper;
};

/// Step 2: returns median and upper quartile of the pixels up to the level `end`.
Quartiles quartiles_of(const Histogram& histogram, int end) {
  int total = 0;
  for (int level = 0; level <= end; ++level) total += histogram.of(level);
  int seen = 0, median = -1;
  for (int level = 0;; ++level) {
    seen += histogram.of(level);
    if (median < 0 && 2 * seen >= total) median = level;
    if (4 * seen >= 3 * total) return {median, level};
  }
}

/// For each place, whether more than half of its pixels are over `limit`. An image of clutter alone, white noise for
/// example, has no other background than that: no place of it is clutter.
std::array<bool, kPlaces> clutter_of(const Bytes& bytes, int limit) {
  const auto most = static_cast<std::uint8_t>(std::min(limit, kLevels - 1));
  Bytes over;
  for (std::size_t i = 0; i < kPixels; ++i) over[i] = bytes[i] > most ? 1 : 0;
  std::array<bool, kPlaces> is_clutter;
  for (std::size_t k = 0; k < kPlaces; ++k) {
    std::uint64_t halves[2];
    std::memcpy(halves, over.data() + k * kPlace_px, kPlace_px);
    // The product has the sum of eight bytes in its highest byte.
    is_clutter[k] = ((halves[0] + halves[1]) * 0x0101010101010101U >> 56U) > kPlace_px / 2;
  }
  if (std::ranges::count(is_clutter, true) == static_cast<std::ptrdiff_t>(kPlaces)) is_clutter.fill(false);
  return is_clutter;
}

/// Step 3 for formats of 8 bits.
FloorSums sums_of(const Histogram& histogram, int from, int limit) {
  FloorSums sums;
  for (int level = 0; level <= std::min(limit, kLevels - 1); ++level) sums.add(histogram.of(level), level - from);
  return sums;
}

/// Step 3 for deeper formats.
FloorSums sums_of(const Words& words, const std::array<bool, kPlaces>& is_clutter, int from, int limit) {
  FloorSums sums;
  for (std::size_t i = 0; i < kPixels; ++i) {
    if (!is_clutter[i / kPlace_px] && words[i] <= limit) sums.add(1, words[i] - from);
  }
  return sums;
}

}  // namespace

double marker_threshold(const NoiseFloor& floor, double top) {
  return floor.background + std::max(kThresholdOverNoise * floor.noise, kThresholdOverBackground * top);
}

NoiseFloorReader::NoiseFloorReader(std::uint32_t top)
    : shift_(std::max(0, static_cast<int>(std::bit_width(top)) - 8)) {}

NoiseFloor NoiseFloorReader::read(const Image& image) const {
  const Places places = places_of(image);
  prefetch(image, places);
  Words words;
  Bytes bytes;
  if (bytes_in_place(image.format) == 1 && image.width_px >= static_cast<int>(kPlace_px)) {
    bytes = read_bytes(image, places);
  } else {
    words = read_words(image, places);
    std::ranges::transform(words, bytes.begin(),
                           [this](std::uint16_t word) { return static_cast<std::uint8_t>(word >> shift_); });
  }
  Histogram histogram(bytes);
  const auto [median, upper] = quartiles_of(histogram, background_end(histogram));
  const int quartile = std::max(1, upper - median);
  const int limit = median + static_cast<int>(std::ceil(kLimit_sigmas * kSigmaOfQuartile * quartile));
  const auto is_clutter = clutter_of(bytes, median + kClutter_quartiles * quartile);
  if (shift_ != 0) {
    const int from = median << shift_;
    return floor_of(sums_of(words, is_clutter, from, ((limit + 1) << shift_) - 1), from);
  }
  for (std::size_t k = 0; k < kPlaces; ++k) {
    if (is_clutter[k]) histogram.remove(std::span(bytes).subspan(k * kPlace_px, kPlace_px));
  }
  return floor_of(sums_of(histogram, median, limit), median);
}

}  // namespace mocap::detect
