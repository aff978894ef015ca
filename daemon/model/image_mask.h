#pragma once

#include <vector>

#include "model/points.h"

namespace mocap {

/// A masked part of an image: a lamp, a window, another camera's ring light. A closed polygon of at least three corners
/// in order; the pixels inside the polygon (even-odd rule) are masked.
using MaskPolygon = std::vector<PixelPoint>;

}  // namespace mocap
