#pragma once

namespace mocap::identify {

/// Cost (minus log likelihood) of a marker without a point: equal to the cost of a residual of four standard deviations
/// (4^2 / 2).
inline constexpr double kMissedDetectionCost = 8.0;

}  // namespace mocap::identify
