#pragma once

#include <initializer_list>
#include <span>
#include <string>

#include "model/image_mask.h"

namespace mocap::settings {

// Words, numbers and masks as text in a rig file and in other files that are written.

/// The key of learned masks; the key of drawn masks is `mask`.
inline constexpr const char* kLearntMask = "mask_learnt";

/// The shortest text that reads back as the same bits, with a decimal point, so that every reader takes it as a float.
std::string number_text(double value);

/// In quotes and escaped as a TOML string.
std::string quoted_text(const std::string& value);

/// "[1.0, 2.0]"
std::string list_text(std::initializer_list<double> values);

/// A list of polygons, one polygon per line.
std::string mask_text(std::span<const MaskPolygon> polygons);

}  // namespace mocap::settings
