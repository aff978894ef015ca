#pragma once

#include <vector>

#include "model/points.h"

namespace mocap {

/// A part of an image that shows no markers: a lamp, a window, another camera's ring light. The corners in order, at
/// least three; a side leads from the last to the first. What is inside by the even-odd rule is masked.
using MaskPolygon = std::vector<PixelPoint>;

}  // namespace mocap
