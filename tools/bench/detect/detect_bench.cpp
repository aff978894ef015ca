#include "bench/detect/detect_bench.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <opencv2/core/utility.hpp>
#include <random>
#include <span>

#include "bench/detect/opencv_detector.h"
#include "detect/blob_detector.h"
#include "detect/kernels/detect_kernels.h"

namespace mocap::bench {
namespace {

// Larger than the last-level cache of any machine, so that each image is read from memory.
constexpr std::size_t kSetBytes = 160U << 20U;
constexpr std::size_t kNoiseBytes = 64U << 20U;  // size of each of two image sets
constexpr int kRounds = 12;
constexpr int kDrawn = 24;  // different images; the set repeats them at other addresses
// The Cramer-Rao bound of a disc takes some ms. If there are more discs than this, only every second, third, ... is
// scored.
constexpr std::size_t kScored = 1000;
// About the middle between background (12) and marker (200), where OpenCV's contours are most precise.
constexpr double kOpencvThreshold_grey = 100.0;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <class Work>
double timed_us(Work&& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
}

/// Lower bound of the detection time: reads every byte once, in order, with the widest loads of the processor.
__attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"))) std::uint64_t plain_read(
    const std::byte* bytes, std::size_t size) {
  constexpr std::size_t kLanes = 32;
  std::uint64_t sums[kLanes] = {};
  for (std::size_t at = 0; at + sizeof(sums) <= size; at += sizeof(sums)) {
    std::uint64_t words[kLanes];
    std::memcpy(words, bytes + at, sizeof(words));
    for (std::size_t i = 0; i < kLanes; ++i) sums[i] |= words[i];
  }
  std::uint64_t all = 0;
  for (const std::uint64_t sum : sums) all |= sum;
  return all;
}

Image view_of(std::span<const std::byte> pixels, const simworld::DetectSceneSettings& settings) {
  Image image;
  image.bytes = pixels;
  image.stride_bytes = static_cast<std::size_t>(settings.width_px);
  image.width_px = settings.width_px;
  image.height_px = settings.height_px;
  return image;
}

void time_all(const simworld::DetectSceneSettings& settings, std::span<const simworld::DetectImage> drawn,
              Detector& ours, Detector& opencv, DetectBenchFigures& figures) {
  const std::size_t bytes = drawn[0].pixels.size();
  const std::size_t count = std::max<std::size_t>(3, kSetBytes / bytes);
  std::vector<std::byte> set(count * bytes);
  for (std::size_t i = 0; i < count; ++i) {
    std::copy(drawn[i % drawn.size()].pixels.begin(), drawn[i % drawn.size()].pixels.end(),
              set.begin() + static_cast<std::ptrdiff_t>(i * bytes));
  }
  std::vector<double> read, detect, contours, to_read, to_contours;
  volatile std::uint64_t keep = 0;
  // Each round processes the set once with each method. A ratio is formed within one round, so that the load of the
  // machine affects both of its times.
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> a, b, c;
    for (std::size_t i = 0; i < count; ++i) {
      const std::byte* at = set.data() + i * bytes;
      a.push_back(timed_us([&] { keep = keep | plain_read(at, bytes); }));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Image image = view_of(std::span(set).subspan(i * bytes, bytes), settings);
      b.push_back(timed_us([&] { keep = keep + ours.detect(image).blobs.size(); }));
    }
    for (std::size_t i = 0; i < count; ++i) {
      const Image image = view_of(std::span(set).subspan(i * bytes, bytes), settings);
      c.push_back(timed_us([&] { keep = keep + opencv.detect(image).blobs.size(); }));
    }
    if (round == 0) continue;  // the first round warms memory and code
    read.push_back(median(a));
    detect.push_back(median(b));
    contours.push_back(median(c));
    to_read.push_back(detect.back() / read.back());
    to_contours.push_back(contours.back() / detect.back());
  }
  figures.read_us = median(read);
  figures.median_us = median(detect);
  figures.opencv_us = median(contours);
  figures.ratio_read = median(to_read);
  figures.speedup_opencv = median(to_contours);
}

/// Measures white noise at the worst threshold: at medium thresholds all rows contain noise, at high thresholds the
/// noise forms runs and blobs. The reference is dark images with markers. Neither set fits into the cache.
Status time_white_noise(const simworld::DetectSceneSettings& settings, Detector& ours, DetectBenchFigures& figures) {
  simworld::DetectSceneSettings dark = settings;
  dark.busy = false;
  const std::vector<simworld::DetectImage> drawn = simworld::draw_images(dark, kDrawn);
  const std::size_t bytes = drawn[0].pixels.size(), count = std::max<std::size_t>(3, kNoiseBytes / bytes);
  std::mt19937_64 random(settings.seed);
  std::vector<std::byte> dark_set(count * bytes), noise_set(count * bytes);
  for (std::byte& pixel : noise_set) pixel = static_cast<std::byte>(random() & 255U);
  for (std::size_t i = 0; i < count; ++i) {
    std::ranges::copy(drawn[i % drawn.size()].pixels, dark_set.begin() + static_cast<std::ptrdiff_t>(i * bytes));
  }
  const auto median_of = [&](std::span<const std::byte> set, Detector& detector) {
    std::vector<double> times;
    volatile std::size_t keep = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Image image = view_of(set.subspan(i * bytes, bytes), settings);
      times.push_back(timed_us([&] { keep = keep + detector.detect(image).blobs.size(); }));
    }
    return median(times);
  };
  median_of(dark_set, ours);  // warms memory and code
  for (const double threshold_grey : {128.0, 224.0, 240.0, 244.0, 246.0, 248.0, 252.0, 255.0}) {
    auto made = detect::make_blob_detector({.threshold = threshold_grey}, PixelFormat::Mono8, settings.width_px,
                                           settings.height_px);
    if (!made) return made.error();
    median_of(noise_set, **made);
    const double dark_us = median_of(dark_set, ours), noise_us = median_of(noise_set, **made);
    if (noise_us / dark_us < figures.ratio_white_noise) continue;
    figures.white_noise_us = noise_us;
    figures.ratio_white_noise = noise_us / dark_us;
  }
  return {};
}

/// Adds squared errors. finished() converts the sums to root mean squares.
void add(DetectRadiusFigures& to, const Blob& blob, const scene::Disc& disc, double bound_px) {
  to.blobs += 1;
  to.centroid_rms_px += 0.5 * (blob.centroid.v - disc.begin_px).squaredNorm();
  to.crlb_px += bound_px * bound_px;
  to.sigma_px += blob.sigma_px * blob.sigma_px;
}

void finish(DetectRadiusFigures& figures) {
  const double n = std::max(1, figures.blobs);
  for (double* each : {&figures.centroid_rms_px, &figures.crlb_px, &figures.sigma_px}) *each = std::sqrt(*each / n);
}

void score(const simworld::DetectSceneSettings& settings, std::span<const simworld::DetectImage> drawn,
           Detector& detector, DetectBenchFigures& figures) {
  const double first = std::floor(settings.least_radius_px);
  for (double radius = first; radius < settings.most_radius_px; radius += 1.0) {
    figures.by_radius.push_back({.radius_px = radius});
  }
  std::size_t markers = 0, found = 0, blobs = 0;
  const auto drawn_discs = static_cast<std::size_t>(settings.markers) * drawn.size();
  const std::size_t step = std::max<std::size_t>(1, (drawn_discs + kScored - 1) / kScored);
  for (const simworld::DetectImage& image : drawn) {
    const Detection seen = detector.detect(view_of(image.pixels, settings));
    blobs += seen.blobs.size();
    markers += image.discs.size();
    for (const scene::Disc& disc : image.discs) {
      const Blob* nearest = nullptr;
      double least = 0.5 * disc.radius_px;
      for (const Blob& blob : seen.blobs) {
        const double distance = (blob.centroid.v - disc.begin_px).norm();
        if (distance >= least) continue;
        least = distance;
        nearest = &blob;
      }
      if (nearest == nullptr) continue;
      if (found++ % step != 0) continue;
      const double bound_px = simworld::centroid_bound_px(disc, settings);
      const auto bin = static_cast<std::size_t>(disc.radius_px - first);
      add(figures.by_radius[std::min(bin, figures.by_radius.size() - 1)], *nearest, disc, bound_px);
      add(figures.all, *nearest, disc, bound_px);
    }
  }
  for (DetectRadiusFigures& each : figures.by_radius) finish(each);
  finish(figures.all);
  figures.recall = static_cast<double>(found) / static_cast<double>(std::max<std::size_t>(1, markers));
  figures.false_per_frame = static_cast<double>(blobs - found) / static_cast<double>(drawn.size());
}

}  // namespace

Result<DetectBenchFigures> run_detect_bench(const simworld::DetectSceneSettings& settings) {
  auto ours = detect::make_blob_detector({}, PixelFormat::Mono8, settings.width_px, settings.height_px);
  if (!ours) return ours.error();
  auto opencv = bench::make_opencv_detector({.threshold = kOpencvThreshold_grey}, PixelFormat::Mono8, settings.width_px,
                                            settings.height_px);
  if (!opencv) return opencv.error();
  cv::setNumThreads(1);  // ours uses one thread; cv::threshold would use all processors
  const std::vector<simworld::DetectImage> drawn = simworld::draw_images(settings, kDrawn);
  DetectBenchFigures figures;
  figures.isa = detect::best_kernels().name;
  score(settings, drawn, **ours, figures);
  time_all(settings, drawn, **ours, **opencv, figures);
  if (const Status timed = time_white_noise(settings, **ours, figures); !timed) return timed.error();
  return figures;
}

}  // namespace mocap::bench
