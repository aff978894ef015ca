#pragma once

#include <initializer_list>
#include <span>
#include <string>

#include "model/image_mask.h"

namespace mocap::settings {

// How words, numbers and masks stand in a rig file, and in others that we write.

/// The key of the masks that were learnt; those that somebody drew are `mask`.
inline constexpr const char* kLearntMask = "mask_learnt";

/// The shortest text that reads back as the same bits, with a point so that every reader takes it for a float.
std::string number_text(double value);

/// In quotes, so that TOML reads back the same.
std::string quoted_text(const std::string& value);

/// "[1.0, 2.0]"
std::string list_text(std::initializer_list<double> values);

/// A list of polygons, one a line: short to read and to compare.
std::string mask_text(std::span<const MaskPolygon> polygons);

}  // namespace mocap::settings
