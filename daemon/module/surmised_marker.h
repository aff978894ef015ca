#pragma once

#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// A track that is surely a marker of one limb, and nobody can say which: the likeliest. Not a name: it tells where the
/// limb is.
struct SurmisedMarker {
  Label label;
  WorldPoint position;  ///< of the likeliest, in the middle of where it is by each marker that the track may be
};

}  // namespace mocap
