#include "fusion/idle_parts.h"

#include <memory>

namespace mocap::fusion {

FusionParts make_idle_parts() {
  FusionParts parts;
  parts.matcher = std::make_unique<IdleMatcher>();
  parts.triangulator = std::make_unique<IdleTriangulator>();
  parts.tracker = std::make_unique<IdleTracker>();
  parts.labeller = std::make_unique<IdleLabeller>();
  parts.solver = std::make_unique<IdleSolver>();
  return parts;
}

}  // namespace mocap::fusion
