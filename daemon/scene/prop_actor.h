#pragma once

#include <memory>
#include <string_view>

#include "base/result.h"
#include "scene/actor.h"

namespace mocap::scene {

/// A prop for the calibration of a volume, from a text.
/// "wand:0,160,500": a stick with markers at these positions (mm), waved through 2.6 x 2.6 x 1.5 m around the centre of
/// the volume in all directions. "frame:600,400": three markers in an L on the floor, the corner in the centre, the
/// long arm along x, the short arm along y (mm). "wand" and "frame" without numbers have these numbers. Fails with
/// InvalidArgument.
Result<std::unique_ptr<Actor>> make_prop_actor(std::string_view text);

/// Whether the text starts with the name of a prop.
bool is_prop(std::string_view text);

}  // namespace mocap::scene
