#pragma once

#include <string>

#include "eval/marker_pipeline.h"
#include "eval/points_score.h"
#include "lib/simworld/points_world.h"

namespace mocap::eval {

/// Describes the ghosts of the scorer's last set, one line each: the track, its age, whether it was predicted, the
/// nearest light, and the lights in the blobs of its match in each camera.
std::string describe_ghosts(int set, const simworld::SeenInstant& truth, const MarkerPipeline& pipeline,
                            const PointsScorer& scorer);

/// Describes the known lights with two views that were missed in the scorer's last set, one line each: the matches that
/// used their blobs.
std::string describe_misses(int set, const simworld::SeenInstant& truth, const MarkerPipeline& pipeline,
                            const PointsScorer& scorer);

}  // namespace mocap::eval
