#pragma once

#include <string>

#include "model/skeleton.h"

namespace mocap::ctl {

/// Draws a marker set in its rest pose as SVG: seen from the front (the subject's left hand is on the right side of the
/// picture) and from the back, with the bones as lines and a label at each marker. A marker that is more than 1 cm
/// behind its joint has its label in the back view only, a marker that far before it in the front view only; the other
/// view shows it pale. A set of one bone is drawn from the front and from above, with all labels in both views.
std::string marker_set_svg(const MarkerSet& set);

}  // namespace mocap::ctl
