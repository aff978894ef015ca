#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// Where a long component is thin.
struct Waist {
  bool splits = false;    ///< two discs that touch
  bool doubtful = false;  ///< may be more than one
  double at_px = 0.0;     ///< along the axis, from the middle
};

/// Looks along the axis for a waist between two humps of light. A disc that motion drew out has none.
Waist find_waist(const Box& box, std::uint32_t threshold, const Eigen::Vector2d& middle_px,
                 const Eigen::Vector2d& axis);

/// Sets all pixels to 0 that lie before `at_px` along the axis (far side kept), or from there on.
void keep_side(std::span<std::uint16_t> pixels, const Box& box, const Eigen::Vector2d& middle_px,
               const Eigen::Vector2d& axis, double at_px, bool far_side);

/// Second moments of what is bright in a box: xx, yy and xy; a pixel is a square, not a point.
Eigen::Vector3d moments_of(const Box& box, std::uint32_t threshold);

}  // namespace mocap::detect
