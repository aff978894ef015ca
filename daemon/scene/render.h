#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/camera_model.h"

namespace mocap::scene {

/// How a camera's images look. Grey levels are those of 8 bits, 0 to 255.
struct ImageSettings {
  double exposure_s = 500e-6;
  double marker_radius_m = 0.0075;  ///< a ball; shown as a disc of f * radius / distance px
  double least_radius_px = 1.5;     ///< a disc is shown at least so large: the glare of a retroreflector
  double peak_grey = 230.0;         ///< in the middle of a large disc; over 255 saturates
  double point_spread_px = 0.5;     ///< standard deviation of the lens's blur
  double background_grey = 12.0;
  double read_noise_grey = 2.0;      ///< standard deviation
  double electrons_per_grey = 40.0;  ///< shot noise is sqrt(light / this); 0: none
  int clutter = 0;                   ///< lights that do not move and are nobody's marker
  bool occlusion = true;             ///< the body hides markers
  bool nobody = false;               ///< the volume is empty: only clutter shines
  std::uint64_t seed = 1;
};

/// A disc of light: its middle moved on a straight line during the exposure.
struct Disc {
  Eigen::Vector2d begin_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d end_px = Eigen::Vector2d::Zero();
  double radius_px = 0.0;
  double share = 1.0;  ///< of the exposure that this stretch of its way took
};

/// Draws discs of light into 8-bit images. A disc is the exact integral of a uniform disc, blurred by a Gaussian, over
/// each pixel's area (to 1e-4 of the peak); motion is drawn in steps of at most half a pixel. The same seed, number and
/// discs give the same bytes. Touches only the discs' pixels beside one copy of the background.
class Renderer {
 public:
  Renderer(int width_px, int height_px, const ImageSettings& settings, std::uint64_t camera);

  /// Draws image `number` into `pixels`, width times height bytes, row by row. Allocates nothing.
  void render(std::span<const Disc> discs, std::uint64_t number, std::span<std::byte> pixels);

 private:
  struct Patch {
    int x, y, width, height;
  };

  void add_light(const Eigen::Vector2d& middle_px, double radius_px, double grey);
  void develop(const Patch& patch, std::uint64_t number, std::span<std::byte> pixels);
  void lay_background(std::uint64_t number, std::span<std::byte> pixels) const;
  std::optional<Patch> patch_around(const Eigen::Vector2d& middle_px, double radius_px) const;

  int width_px_, height_px_;
  ImageSettings settings_;
  std::uint64_t key_;                ///< of this camera's noise
  std::vector<std::uint8_t> dark_;   ///< background and its noise, larger than the image by kSlack each way
  std::vector<float> normals_;       ///< standard normal deviates
  std::vector<float> light_;         ///< grey levels of light; zero between calls
  std::vector<float> row_, column_;  ///< scratch of one disc
};

}  // namespace mocap::scene
