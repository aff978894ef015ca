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
  bool there = true;  ///< false: the recording has no position at this instant; the marker is not drawn
};

/// The state of an actor at one instant, in the world frame.
struct ActorState {
  BoundedVector<ActorMarker, kMaxLabels> markers;  ///< in the order of the marker set
  BoundedVector<Pose, kMaxBones> world_from_bone;  ///< by bone; empty if the motion has no bones
  BoundedVector<WorldPoint, kMaxLabels> ghosts;    ///< bright points that are no markers of the set
};

/// A person or prop that moves through the simulated volume. The state depends on the time only. Any thread may call.
class Actor {
 public:
  virtual ~Actor() = default;

  virtual const MarkerSet& marker_set() const = 0;

  /// Writes the state `t_s` after the start of the motion; for negative times, that at 0. Allocates nothing after the
  /// first call.
  virtual void at(double t_s, ActorState& into) const = 0;
};

}  // namespace mocap::scene
