#include "paper_study/see.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/expects.h"
#include "detect/blob_detector.h"
#include "paper_study/paper_detector.h"

namespace mocap::paper_study {
namespace {

constexpr int kSubpixels = 4;  // samples per axis in a pixel at the edge of a barrier

scene::ImageSettings image_settings() {
  scene::ImageSettings image;
  image.peak_grey = 255.0;
  image.point_spread_px = 0.0;  // only the exact coverage of each pixel by the disc smooths the edge
  image.background_grey = 0.0;
  image.read_noise_grey = 0.0;
  image.electrons_per_grey = 0.0;
  return image;
}

std::unique_ptr<Detector> make_our_detector() {
  auto made = detect::make_blob_detector(detect::DetectSettings{}, PixelFormat::Mono8, kWidth_px, kHeight_px);
  MOCAP_EXPECTS(made.has_value());
  return std::move(*made);
}

/// Share of a pixel that the barrier does not cover.
double free_share(const Barrier& barrier, const Eigen::Vector2d& pixel) {
  constexpr double kHalfDiagonal_px = 0.71;
  if (barrier.distance_px(pixel) > kHalfDiagonal_px) return 1.0;
  int free = 0;
  for (int j = 0; j < kSubpixels; ++j) {
    for (int i = 0; i < kSubpixels; ++i) {
      const Eigen::Vector2d offset((i + 0.5) / kSubpixels - 0.5, (j + 0.5) / kSubpixels - 0.5);
      if (!barrier.covers(pixel + offset)) ++free;
    }
  }
  return static_cast<double>(free) / (kSubpixels * kSubpixels);
}

void hide(const Barrier& barrier, std::span<std::byte> pixels) {
  const double reach_px = std::hypot(barrier.half_length_px, barrier.half_height_px) + 1.0;
  const int x0 = std::max(0, static_cast<int>(barrier.centre_px.x() - reach_px));
  const int x1 = std::min(kWidth_px - 1, static_cast<int>(barrier.centre_px.x() + reach_px) + 1);
  const int y0 = std::max(0, static_cast<int>(barrier.centre_px.y() - reach_px));
  const int y1 = std::min(kHeight_px - 1, static_cast<int>(barrier.centre_px.y() + reach_px) + 1);
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      std::byte& pixel = pixels[static_cast<std::size_t>(y) * kWidth_px + static_cast<std::size_t>(x)];
      const int grey = std::to_integer<int>(pixel);
      if (grey == 0) continue;
      const double share = free_share(barrier, {static_cast<double>(x), static_cast<double>(y)});
      pixel = static_cast<std::byte>(std::lround(grey * share));
    }
  }
}

Seen seen_by(Detector& detector, const Image& image, Timestamp at) {
  const Detection found = detector.detect(image);
  return {at, {found.blobs.begin(), found.blobs.end()}};
}

}  // namespace

Viewer::Viewer()
    : renderer_(kWidth_px, kHeight_px, image_settings(), 0),
      paper_(make_paper_detector(kWidth_px, kHeight_px)),
      ours_(make_our_detector()),
      pixels_(static_cast<std::size_t>(kWidth_px) * kHeight_px) {}

std::span<const std::byte> Viewer::draw(const Clip& clip, std::size_t frame) {
  discs_.clear();
  for (const auto& way : clip.ways_px) discs_.push_back({way[frame], way[frame], kDiscRadius_px, 1.0});
  renderer_.render(discs_, 0, pixels_);
  for (const Barrier& barrier : clip.barriers) hide(barrier, pixels_);
  return pixels_;
}

Sightings Viewer::see(const Clip& clip) {
  Sightings sightings;
  for (std::size_t frame = 0; frame < clip.frames(); ++frame) {
    const Image image{draw(clip, frame), kWidth_px, kWidth_px, kHeight_px, PixelFormat::Mono8};
    const Timestamp at = from_ns(0) + from_s(static_cast<double>(frame) / kFrameRate_Hz);
    sightings.paper.push_back(seen_by(*paper_, image, at));
    sightings.ours.push_back(seen_by(*ours_, image, at));
  }
  return sightings;
}

}  // namespace mocap::paper_study
