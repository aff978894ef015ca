#include "scene/render.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "base/expects.h"
#include "scene/random.h"

namespace mocap::scene {
namespace {

constexpr int kSlack = 128;  // range of the random shift of the background noise from image to image, px
constexpr std::size_t kNormals = 1 << 16;
constexpr double kStep_px = 0.5;  // of motion within the exposure
constexpr int kMaxSteps = 64;
constexpr int kMaxStrips = 64;
constexpr double kReach_sigmas = 4.0;    // extent of the blur: 3e-5 of the light is beyond
constexpr double kLeastBlur_px = 0.05;   // smallest blur, to keep the integrals smooth
constexpr double kMaxRadius_px = 200.0;  // a larger disc is not drawn: the marker is at the lens

// Tables of the Gaussian cumulative distribution Phi and of its integral over x. The difference quotient of the
// integral over a pixel is the light of a blurred edge in the pixel. Grid of 1/256 sigma, linear interpolation: error
// below 2e-6.
class PhiTables {
 public:
  PhiTables() {
    for (std::size_t i = 0; i < kSize; ++i) {
      const double x = static_cast<double>(i) / kPerSigma - kEnd;
      phi_[i] = 0.5 * std::erfc(-x / std::numbers::sqrt2);
      integral_[i] = x * phi_[i] + std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi);
    }
  }
  double phi(double x) const { return x <= -kEnd ? 0.0 : x >= kEnd ? 1.0 : look_up(phi_, x); }
  double integral(double x) const { return x <= -kEnd ? 0.0 : x >= kEnd ? x : look_up(integral_, x); }

 private:
  static constexpr double kEnd = 5.0;
  static constexpr double kPerSigma = 256.0;
  static constexpr std::size_t kSize = 2562;

  static double look_up(const std::array<double, kSize>& table, double x) {
    const double at = (x + kEnd) * kPerSigma;
    const auto i = static_cast<std::size_t>(at);
    const double share = at - static_cast<double>(i);
    return table[i] + share * (table[i + 1] - table[i]);
  }

  std::array<double, kSize> phi_{};
  std::array<double, kSize> integral_{};
};

const PhiTables& tables() {
  static const PhiTables the_tables;
  return the_tables;
}

}  // namespace

Renderer::Renderer(int width_px, int height_px, const ImageSettings& settings, std::uint64_t camera)
    : width_px_(width_px), height_px_(height_px), settings_(settings), key_(mixed(settings.seed) ^ mixed(camera + 77)) {
  MOCAP_EXPECTS(width_px > 0 && height_px > 0);
  settings_.point_spread_px = std::max(settings_.point_spread_px, kLeastBlur_px);
  const auto width = static_cast<std::size_t>(width_px), height = static_cast<std::size_t>(height_px);
  Random random(key_);
  normals_.resize(kNormals);
  for (float& normal : normals_) normal = static_cast<float>(random.normal());
  dark_.resize((width + kSlack) * (height + kSlack));
  for (std::uint8_t& dark : dark_) {
    const double noise = normals_[random.bits() % kNormals] * settings_.read_noise_grey;
    dark = static_cast<std::uint8_t>(std::clamp(std::lround(settings_.background_grey + noise), 0L, 255L));
  }
  light_.resize(width * height);
  row_.resize(width);
  column_.resize(height);
  (void)tables();
}

void Renderer::copy_background(std::uint64_t number, std::span<std::byte> pixels) const {
  const std::uint64_t random = mixed(key_ ^ mixed(number));
  const std::size_t dx = random % kSlack, dy = (random >> 32) % kSlack;
  const auto width = static_cast<std::size_t>(width_px_), stride = width + kSlack;
  for (std::size_t y = 0; y < static_cast<std::size_t>(height_px_); ++y) {
    std::memcpy(pixels.data() + y * width, dark_.data() + (y + dy) * stride + dx, width);
  }
}

std::optional<Renderer::Patch> Renderer::patch_around(const Eigen::Vector2d& middle_px, double radius_px) const {
  const double reach_px = radius_px + kReach_sigmas * settings_.point_spread_px + 1.0;
  const bool seen = middle_px.x() > -reach_px && middle_px.x() < width_px_ - 1 + reach_px &&
                    middle_px.y() > -reach_px && middle_px.y() < height_px_ - 1 + reach_px;
  if (!seen) return std::nullopt;  // also if NaN or infinite
  const int x0 = std::max(0, static_cast<int>(std::floor(middle_px.x() - reach_px)));
  const int y0 = std::max(0, static_cast<int>(std::floor(middle_px.y() - reach_px)));
  const int x1 = std::min(width_px_ - 1, static_cast<int>(std::ceil(middle_px.x() + reach_px)));
  const int y1 = std::min(height_px_ - 1, static_cast<int>(std::ceil(middle_px.y() + reach_px)));
  if (x1 < x0 || y1 < y0) return std::nullopt;
  return Patch{x0, y0, x1 - x0 + 1, y1 - y0 + 1};
}

// Cuts the disc into strips of constant v. The light of a blurred strip is the product of a function of the column and
// a function of the row. The midpoint rule over the angle a, with v = r sin a, converges fast, as the integrand is
// smooth.
void Renderer::add_light(const Eigen::Vector2d& middle_px, double radius_px, double grey) {
  const auto patch = patch_around(middle_px, radius_px);
  if (!patch) return;
  const double sigma = settings_.point_spread_px;
  const int strips = std::min(kMaxStrips, 8 + 2 * static_cast<int>(std::ceil(radius_px / std::min(1.0, 2.0 * sigma))));
  const auto columns = static_cast<std::size_t>(patch->width), rows = static_cast<std::size_t>(patch->height);
  for (int k = 0; k < strips; ++k) {
    const double angle = std::numbers::pi * ((k + 0.5) / strips - 0.5);
    const double v = middle_px.y() + radius_px * std::sin(angle), half = radius_px * std::cos(angle);
    const double weight = grey * half * std::numbers::pi / strips;
    double low = tables().phi((patch->y - 0.5 - v) / sigma);
    for (std::size_t j = 0; j < rows; ++j) {
      const double high = tables().phi((patch->y + static_cast<double>(j) + 0.5 - v) / sigma);
      column_[j] = static_cast<float>(weight * (high - low));
      low = high;
    }
    // The light of a blurred strip in a pixel: second difference of the integral of Phi.
    const auto edge = [&](double x) {
      return sigma * (tables().integral((x - middle_px.x() + half) / sigma) -
                      tables().integral((x - middle_px.x() - half) / sigma));
    };
    double left = edge(patch->x - 0.5);
    for (std::size_t i = 0; i < columns; ++i) {
      const double right = edge(patch->x + static_cast<double>(i) + 0.5);
      row_[i] = static_cast<float>(right - left);
      left = right;
    }
    for (std::size_t j = 0; j < rows; ++j) {
      float* light = light_.data() + (static_cast<std::size_t>(patch->y) + j) * static_cast<std::size_t>(width_px_) +
                     static_cast<std::size_t>(patch->x);
      for (std::size_t i = 0; i < columns; ++i) light[i] += column_[j] * row_[i];
    }
  }
}

// Converts light to grey levels with noise, and sets the light to zero.
void Renderer::develop(const Patch& patch, std::uint64_t number, std::span<std::byte> pixels) {
  const auto base = static_cast<float>(settings_.background_grey);
  const auto read = static_cast<float>(settings_.read_noise_grey);
  const auto shot = static_cast<float>(settings_.electrons_per_grey > 0.0 ? 1.0 / settings_.electrons_per_grey : 0.0);
  for (int y = patch.y; y < patch.y + patch.height; ++y) {
    const std::size_t begin = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_);
    std::uint64_t random = mixed(key_ ^ mixed((number << 16) + static_cast<std::uint64_t>(y)));
    for (int x = patch.x; x < patch.x + patch.width; ++x) {
      float& light = light_[begin + static_cast<std::size_t>(x)];
      if (light < 0.02F) {  // negligible, or already converted by an overlapping patch
        light = 0.0F;
        continue;
      }
      const float deviate = normals_[(random + static_cast<std::uint64_t>(x) * 2654435761U) % kNormals];
      const float sigma = std::sqrt(read * read + shot * light);
      const float grey = std::clamp(base + light + sigma * deviate, 0.0F, 255.0F);
      pixels[begin + static_cast<std::size_t>(x)] = static_cast<std::byte>(static_cast<int>(grey + 0.5F));
      light = 0.0F;
    }
  }
}

void Renderer::render(std::span<const Disc> discs, std::uint64_t number, std::span<std::byte> pixels) {
  MOCAP_EXPECTS(pixels.size() == light_.size());
  copy_background(number, pixels);
  const auto usable = [](const Disc& disc) { return disc.radius_px > 0.0 && disc.radius_px < kMaxRadius_px; };
  for (const Disc& disc : discs) {
    if (!usable(disc)) continue;
    const Eigen::Vector2d way_px = disc.end_px - disc.begin_px;
    const double length_px = std::min(way_px.norm(), kMaxSteps * kStep_px);
    const int steps = 1 + static_cast<int>(length_px / kStep_px);
    for (int i = 0; i < steps; ++i) {
      add_light(disc.begin_px + way_px * ((i + 0.5) / steps), disc.radius_px, settings_.peak_grey * disc.share / steps);
    }
  }
  for (const Disc& disc : discs) {
    if (!usable(disc)) continue;
    const Eigen::Vector2d middle_px = 0.5 * (disc.begin_px + disc.end_px);
    const double half_px = 0.5 * (disc.end_px - disc.begin_px).norm();
    if (const auto patch = patch_around(middle_px, disc.radius_px + half_px)) develop(*patch, number, pixels);
  }
}

}  // namespace mocap::scene
