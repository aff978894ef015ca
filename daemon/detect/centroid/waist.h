#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// The waist of an elongated component.
struct Waist {
  bool splits = false;    ///< the component is two touching discs
  bool doubtful = false;  ///< the component may be more than one disc
  double at_px = 0.0;     ///< position along the major axis, from the centre
};

/// Finds a minimum between two maxima of the light along the major axis. A disc that is streaked by motion has none.
Waist find_waist(const Box& box, std::uint32_t threshold, const Eigen::Vector2d& middle_px,
                 const Eigen::Vector2d& axis);

/// Sets the pixels before `at_px` along the axis to 0 (keeping the far side), or those from there on.
void keep_side(std::span<std::uint16_t> pixels, const Box& box, const Eigen::Vector2d& middle_px,
               const Eigen::Vector2d& axis, double at_px, bool far_side);

/// Second moments of the bright pixels of a box: xx, yy and xy; a pixel is a unit square.
Eigen::Vector3d moments_of(const Box& box, std::uint32_t threshold);

}  // namespace mocap::detect
