#pragma once

#include <string>

#include "eval/points_row.h"
#include "eval/points_score.h"
#include "lib/simworld/points_world.h"

namespace mocap::eval {

/// What the ghosts of the scorer's last set were made of, one line each: the track, how old it is, whether the matcher
/// expected it, the nearest light, and the lights in the blobs of its match, camera by camera.
std::string describe_ghosts(int set, const simworld::SeenInstant& truth, const PointsRow& row,
                            const PointsScorer& scorer);

/// The known lights with two views that the scorer's last set missed, one line each: whose their blobs became.
std::string describe_misses(int set, const simworld::SeenInstant& truth, const PointsRow& row,
                            const PointsScorer& scorer);

}  // namespace mocap::eval
