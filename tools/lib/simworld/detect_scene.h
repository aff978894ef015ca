#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/render.h"

namespace mocap::simworld {

/// Content of the images of the detection bench.
struct DetectSceneSettings {
  int width_px = 1280;
  int height_px = 1024;
  int markers = 40;
  bool busy = false;  ///< add bright clutter: lamps, edges, cables
  double least_radius_px = 2.0;
  double most_radius_px = 8.0;
  double peak_grey = 200.0;  ///< above the background; saturates from about 240
  double noise_grey = 3.0;
  std::uint64_t seed = 1;
};

inline constexpr double kBackground_grey = 12.0;
inline constexpr double kPointSpread_px = 0.5;

struct DetectImage {
  std::vector<std::byte> pixels;  ///< 8 bits, row-major
  std::vector<scene::Disc> discs;
};

/// Draws `count` images. Each has its own random markers, which touch neither each other nor the clutter nor the
/// border.
std::vector<DetectImage> draw_images(const DetectSceneSettings& settings, int count);

/// The Cramer-Rao bound of the centroid of a disc: standard deviation in px, root mean square of both axes. The Fisher
/// information of a pixel follows from the intensity gradient, the noise (including quantisation) and saturation.
/// Unknown size and brightness do not change the bound because a disc is symmetric.
double centroid_bound_px(const scene::Disc& disc, const DetectSceneSettings& settings);

}  // namespace mocap::simworld
