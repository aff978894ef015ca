#pragma once

#include "base/bounded_vector.h"
#include "model/bounds.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// A 3D track that certainly is one of several markers of a limb, while the association cannot tell which: the marginal
/// of the track over these markers. It gives the track no label, but it constrains the pose of the limb.
struct AmbiguousObservation {
  Label label;           ///< the most likely marker
  WorldPoint position;   ///< of that marker: the mean over the possible markers
  double sigma_m = 0.0;  ///< standard deviation over the possible markers, each axis
};

using AmbiguousObservations = BoundedVector<AmbiguousObservation, kMaxMarkers>;

}  // namespace mocap
