#include "lib/simworld/detect_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace mocap::simworld {
namespace {

constexpr double kTop_grey = 255.0;
constexpr double kGap_px =
    8.0;  // least distance of two pieces: twice the sum of the blur and the border by which a blob is grown
constexpr int kTries = 20000;
constexpr int kClutterPieces = 60;

struct Piece {
  double x, y, half_width, half_height;
};

bool apart(const Piece& a, const Piece& b) {
  return std::abs(a.x - b.x) > a.half_width + b.half_width + kGap_px ||
         std::abs(a.y - b.y) > a.half_height + b.half_height + kGap_px;
}

/// Places pieces at random positions so that no piece touches another.
class Layout {
 public:
  Layout(const DetectSceneSettings& settings, std::uint64_t seed) : settings_(settings), random_(seed) {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  bool place(Piece& piece) {
    for (int i = 0; i < kTries; ++i) {
      const double margin_x = piece.half_width + kGap_px, margin_y = piece.half_height + kGap_px;
      if (2 * margin_x >= settings_.width_px || 2 * margin_y >= settings_.height_px) return false;
      piece.x = uniform(margin_x, settings_.width_px - margin_x);
      piece.y = uniform(margin_y, settings_.height_px - margin_y);
      if (std::all_of(taken_.begin(), taken_.end(), [&](const Piece& other) { return apart(piece, other); })) {
        taken_.push_back(piece);
        return true;
      }
    }
    return false;
  }

 private:
  const DetectSceneSettings& settings_;
  std::mt19937_64 random_;
  std::vector<Piece> taken_;
};

/// Bright rectangles in the shape of lamps, edges and cables.
std::vector<Piece> clutter_of(Layout& layout) {
  std::vector<Piece> pieces;
  for (int i = 0; i < kClutterPieces; ++i) {
    Piece piece{};
    piece.half_width = i % 3 == 0 ? layout.uniform(36.0, 50.0) : i % 3 == 1 ? layout.uniform(20.0, 60.0) : 1.0;
    piece.half_height = i % 3 == 0 ? layout.uniform(36.0, 50.0) : i % 3 == 1 ? 1.0 : layout.uniform(20.0, 60.0);
    if (layout.place(piece)) pieces.push_back(piece);
  }
  return pieces;
}

double phi(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); }
double cumulated(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

/// The light on the pixel at the origin from a blurred disc of brightness 1 with centre (dx, dy), px.
double light_on_pixel(double dx, double dy, double radius_px) {
  const double s = kPointSpread_px;
  const auto integral = [s](double x) { return x * cumulated(x / s) + s * phi(x / s); };
  constexpr int kStrips = 48;
  double light = 0.0;
  for (int k = 0; k < kStrips; ++k) {
    const double angle = std::numbers::pi * ((k + 0.5) / kStrips - 0.5);
    const double v = dy + radius_px * std::sin(angle), half = radius_px * std::cos(angle);
    const double row = cumulated((0.5 - v) / s) - cumulated((-0.5 - v) / s);
    const double column =
        integral(0.5 - dx + half) - integral(-0.5 - dx + half) - integral(0.5 - dx - half) + integral(-0.5 - dx - half);
    light += row * column * half * std::numbers::pi / kStrips;
  }
  return light;
}

/// Fisher information of one pixel value about its mean `grey`, times the noise variance. 1 within the range; less
/// where saturation at kTop_grey censors the noise.
double censored_information(double grey, double sigma) {
  const double z = (kTop_grey - grey) / sigma;
  if (z > 6.0) return 1.0;
  if (z < -6.0) return 0.0;
  const double over = cumulated(-z);
  return cumulated(z) - z * phi(z) + phi(z) * phi(z) / std::max(over, 1e-300);
}

}  // namespace

std::vector<DetectImage> draw_images(const DetectSceneSettings& settings, int count) {
  scene::ImageSettings look;
  look.peak_grey = settings.peak_grey;
  look.point_spread_px = kPointSpread_px;
  look.background_grey = kBackground_grey;
  look.read_noise_grey = settings.noise_grey;
  look.electrons_per_grey = 0.0;
  look.seed = settings.seed;
  scene::Renderer renderer(settings.width_px, settings.height_px, look, 0);
  std::vector<DetectImage> images(static_cast<std::size_t>(count));
  for (std::size_t n = 0; n < images.size(); ++n) {
    DetectImage& image = images[n];
    Layout layout(settings, settings.seed * 1000003 + n);
    const std::vector<Piece> clutter = settings.busy ? clutter_of(layout) : std::vector<Piece>{};
    for (int i = 0; i < settings.markers; ++i) {
      const double radius = layout.uniform(settings.least_radius_px, settings.most_radius_px);
      Piece piece{0.0, 0.0, radius, radius};
      if (!layout.place(piece)) break;
      image.discs.push_back({{piece.x, piece.y}, {piece.x, piece.y}, radius, 1.0});
    }
    image.pixels.resize(static_cast<std::size_t>(settings.width_px) * static_cast<std::size_t>(settings.height_px));
    renderer.render(image.discs, n, image.pixels);
    for (const Piece& piece : clutter) {
      for (int y = static_cast<int>(piece.y - piece.half_height); y <= static_cast<int>(piece.y + piece.half_height);
           ++y) {
        for (int x = static_cast<int>(piece.x - piece.half_width); x <= static_cast<int>(piece.x + piece.half_width);
             ++x) {
          image.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(settings.width_px) +
                       static_cast<std::size_t>(x)] = std::byte{240};
        }
      }
    }
  }
  return images;
}

double centroid_bound_px(const scene::Disc& disc, const DetectSceneSettings& settings) {
  constexpr double kStep_px = 1e-3;
  // Pixels farther from the edge of the disc than half a pixel diagonal plus 6 standard deviations of the blur have no
  // intensity gradient, so they carry no information about the position.
  constexpr double kRim_px = 0.71 + 6.0 * kPointSpread_px;
  const double sigma = std::sqrt(settings.noise_grey * settings.noise_grey + 1.0 / 12.0);
  const int reach = static_cast<int>(std::ceil(disc.radius_px + 5.0));
  const int middle_x = static_cast<int>(std::lround(disc.begin_px.x()));
  const int middle_y = static_cast<int>(std::lround(disc.begin_px.y()));
  double information_x = 0.0, information_y = 0.0;
  for (int y = middle_y - reach; y <= middle_y + reach; ++y) {
    for (int x = middle_x - reach; x <= middle_x + reach; ++x) {
      const double dx = disc.begin_px.x() - x, dy = disc.begin_px.y() - y;
      if (std::abs(std::hypot(dx, dy) - disc.radius_px) > kRim_px) continue;
      const auto light = [&](double u, double v) { return settings.peak_grey * light_on_pixel(u, v, disc.radius_px); };
      const double slope_x = (light(dx + kStep_px, dy) - light(dx - kStep_px, dy)) / (2.0 * kStep_px);
      const double slope_y = (light(dx, dy + kStep_px) - light(dx, dy - kStep_px)) / (2.0 * kStep_px);
      const double information = censored_information(kBackground_grey + light(dx, dy), sigma) / (sigma * sigma);
      information_x += information * slope_x * slope_x;
      information_y += information * slope_y * slope_y;
    }
  }
  return std::sqrt(0.5 * (1.0 / information_x + 1.0 / information_y));
}

}  // namespace mocap::simworld
