#pragma once

#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// A track that is surely a marker of one limb, and nobody can say which: the likeliest. Not a name: it tells where the
/// limb is.
struct AmbiguousObservation {
  Label label;
  WorldPoint position;   ///< of the likeliest: the mean of where it is by each marker that the track may be
  double sigma_m = 0.0;  ///< of these places about their mean, each axis
};

}  // namespace mocap
