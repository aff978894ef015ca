#pragma once

#include <string>

#include "base/result.h"
#include "scene/c3d.h"

namespace mocap::simworld {

/// Reads the text of a TRC file as the points of a C3D file. A point at the origin is a gap, and a column without a
/// name is an unlabelled point. Fails with InvalidArgument if rate, names or frames are missing.
Result<scene::C3d> parse_trc(const std::string& text);

}  // namespace mocap::simworld
