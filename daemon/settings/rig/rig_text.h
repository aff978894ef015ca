#pragma once

#include <span>
#include <string>

#include "base/literal_text.h"
#include "model/image_mask.h"

namespace mocap::settings {

// Words, numbers and masks as text in a rig file and in other files that are written.

/// The keys of drawn and of learned masks.
inline constexpr const char* kDrawnMask = "mask";
inline constexpr const char* kLearntMask = "mask_learnt";

/// The key of Lens::is_from_fov.
inline constexpr const char* kLensFromFov = "lens_from_fov";

using mocap::list_text;
using mocap::number_text;
using mocap::quoted_text;

/// A list of polygons, one polygon per line.
std::string mask_text(std::span<const MaskPolygon> polygons);

}  // namespace mocap::settings
