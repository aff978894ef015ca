#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/render.h"

namespace mocap::simworld {

/// What the images of the detection bench show.
struct DetectSceneSettings {
  int width_px = 1280;
  int height_px = 1024;
  int markers = 40;
  bool busy = false;  ///< with bright clutter: lamps, edges, cables
  double least_radius_px = 2.0;
  double most_radius_px = 8.0;
  double peak_grey = 200.0;  ///< over the background; from about 240 on it saturates
  double noise_grey = 3.0;
  std::uint64_t seed = 1;
};

inline constexpr double kBackground_grey = 12.0;
inline constexpr double kPointSpread_px = 0.5;

struct DetectImage {
  std::vector<std::byte> pixels;  ///< 8 bits, row after row
  std::vector<scene::Disc> discs;
};

/// Draws `count` images, each with markers of its own that touch neither each other nor the clutter nor the border.
std::vector<DetectImage> draw_images(const DetectSceneSettings& settings, int count);

/// The Cramer-Rao bound of the centroid of such a disc, standard deviation in px, root mean square of both axes: each
/// pixel tells of its shift what its slope, the noise (with that of rounding) and the end of the range leave. Size and
/// brightness being unknown costs nothing: a disc is symmetric.
double centroid_bound_px(const scene::Disc& disc, const DetectSceneSettings& settings);

}  // namespace mocap::simworld
