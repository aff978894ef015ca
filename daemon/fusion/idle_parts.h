#pragma once

#include "fusion/fusion.h"

namespace mocap::fusion {

/// Parts that find no marker and no skeleton: for a node, whose blobs another daemon fuses. A snapshot then has the
/// views of its set and nothing else.
FusionParts make_idle_parts();

}  // namespace mocap::fusion
