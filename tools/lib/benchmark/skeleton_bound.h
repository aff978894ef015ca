#pragma once

#include <cstdint>

#include "lib/benchmark/point_noise.h"
#include "lib/benchmark/posed_clip.h"
#include "lib/benchmark/skeleton_errors.h"

namespace mocap::benchmark {

/// The errors of the best solver of single frames that is given the true body, the true labels and the distribution of
/// the soft tissue: samples of a normal distribution whose covariance is the Bayesian Cramér-Rao bound of the pose.
/// Shifted points and ghosts count as absent. The prior of a joint is 35 degrees rms from its true rotation, so bones
/// without a marker have errors of that size; the root has no prior.
///
/// Each tenth frame, ten samples. The same arguments give the same figures. A clip without soft tissue has no errors.
///
/// Source: Van Trees, Detection, Estimation, and Modulation Theory, part I (1968), section 2.4.
SkeletonFigures skeleton_bound(const PosedClip& clip, const PointNoise& noise, std::uint64_t seed);

}  // namespace mocap::benchmark
