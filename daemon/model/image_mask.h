#pragma once

#include <vector>

#include "model/points.h"

namespace mocap {

/// A masked part of an image: a lamp, a window, another camera's ring light. The corners in order, at
/// least three; the polygon is closed. Its inside by the even-odd rule is masked.
using MaskPolygon = std::vector<PixelPoint>;

}  // namespace mocap
