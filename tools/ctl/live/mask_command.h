#pragma once

#include <string>

#include "base/result.h"
#include "ctl/live/live_command.h"
#include "model/image_mask.h"

namespace mocap::ctl {

/// The polygon of a rectangle "X,Y,W,H" in pixels: the pixels from column X and row Y on, W wide and H high. Fails if
/// the text is something else.
Result<MaskPolygon> rectangle_of(const std::string& text);

/// The polygon "X,Y,X,Y,X,Y", three corners or more. Fails if the text is something else.
Result<MaskPolygon> polygon_of(const std::string& text);

/// Adds `mask`: the masks of the cameras of the running daemon. The parser sets `options.run` to the chosen command.
void add_mask_command(cli::App& app, LiveOptions& options);

}  // namespace mocap::ctl
