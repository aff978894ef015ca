#pragma once

#include <memory>
#include <string_view>

#include "base/result.h"
#include "scene/actor.h"

namespace mocap::scene {

/// What lies or is waved in a volume to calibrate it, by text: "wand:0,160,500", markers on a stick at these places
/// (mm) that is waved through 2.6 x 2.6 x 1.5 m about the middle, turning every way; "frame:600,400", three markers in
/// an L on the floor, its corner in the middle, the long arm along x, the short one along y. "wand" and "frame" alone
/// mean these. Fails with InvalidArgument.
Result<std::unique_ptr<Actor>> make_prop_actor(std::string_view text);

/// Whether the text begins as one of them.
bool is_prop(std::string_view text);

}  // namespace mocap::scene
