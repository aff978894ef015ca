#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/camera_model.h"

namespace mocap::scene {

/// Parameters of a simulated camera's images. Grey levels are 8-bit, 0 to 255.
struct ImageSettings {
  double exposure_s = 500e-6;
  double marker_radius_m = 0.0075;  ///< of a sphere; drawn as a disc with a radius of f * radius / distance px
  double least_radius_px = 1.5;     ///< smallest radius of a disc: glare of a retroreflector
  double peak_grey = 230.0;         ///< in the middle of a large disc; above 255 the image saturates
  double point_spread_px = 0.5;     ///< standard deviation of the lens blur
  double background_grey = 12.0;
  double read_noise_grey = 2.0;      ///< standard deviation
  double electrons_per_grey = 40.0;  ///< shot noise is sqrt(light / this); 0: none
  int clutter = 0;                   ///< number of static bright points that are no markers
  bool occlusion = true;             ///< the body hides markers
  bool nobody = false;               ///< the volume is empty: only clutter is drawn
  std::uint64_t seed = 1;
};

/// A disc of light whose centre moves on a straight line during the exposure.
struct Disc {
  Eigen::Vector2d begin_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d end_px = Eigen::Vector2d::Zero();
  double radius_px = 0.0;
  double share = 1.0;  ///< fraction of the exposure during which the disc moves on this line
};

/// Draws discs of light into 8-bit images. Each pixel gets the integral over its area of a uniform disc that is blurred
/// by a Gaussian (error below 1e-4 of the peak). Motion is drawn in steps of at most half a pixel. Equal seed, number
/// and discs give equal bytes. The work is one copy of the background plus the pixels of the discs.
class Renderer {
 public:
  Renderer(int width_px, int height_px, const ImageSettings& settings, std::uint64_t camera);

  /// Draws image `number` into `pixels`: width times height bytes, row after row. Allocates nothing.
  void render(std::span<const Disc> discs, std::uint64_t number, std::span<std::byte> pixels);

 private:
  struct Patch {
    int x, y, width, height;
  };

  void add_light(const Eigen::Vector2d& middle_px, double radius_px, double grey);
  void develop(const Patch& patch, std::uint64_t number, std::span<std::byte> pixels);
  void copy_background(std::uint64_t number, std::span<std::byte> pixels) const;
  std::optional<Patch> patch_around(const Eigen::Vector2d& middle_px, double radius_px) const;

  int width_px_, height_px_;
  ImageSettings settings_;
  std::uint64_t key_;                ///< seed of this camera's noise
  std::vector<std::uint8_t> dark_;   ///< background with noise, larger than the image by kSlack in x and y
  std::vector<float> normals_;       ///< standard normal deviates
  std::vector<float> light_;         ///< grey levels of the discs; zero between calls
  std::vector<float> row_, column_;  ///< work space of one disc
};

}  // namespace mocap::scene
