#pragma once

#include <memory>

#include "base/bounded_vector.h"
#include "model/bounds.h"
#include "model/points.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::scene {

struct ActorMarker {
  WorldPoint position;
  bool there = true;  ///< false: the recording does not know where it is, and it gives no light
};

/// Where somebody and all that they wear is at one instant.
struct ActorState {
  BoundedVector<ActorMarker, kMaxLabels> markers;  ///< in the order of the marker set
  BoundedVector<Pose, kMaxBones> world_from_bone;  ///< by bone; empty where the motion knows of no bones
  BoundedVector<WorldPoint, kMaxLabels> ghosts;    ///< lights that are nobody's marker
};

/// Somebody who moves through the volume. The same time gives the same state; any thread may ask.
class Actor {
 public:
  virtual ~Actor() = default;

  virtual const MarkerSet& marker_set() const = 0;

  /// The state `t_s` after the motion began; before that, as at 0. Allocates nothing after the first call.
  virtual void at(double t_s, ActorState& into) const = 0;
};

}  // namespace mocap::scene
