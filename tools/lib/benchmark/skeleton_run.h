#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/result.h"
#include "lib/benchmark/point_noise.h"
#include "lib/benchmark/posed_clip.h"
#include "lib/benchmark/skeleton_errors.h"

namespace mocap::benchmark {

/// The source of the bone lengths and marker offsets of the person.
enum class SkeletonKnown {
  Given,      ///< the true body
  FirstFive,  ///< fitted to the labelled markers of the first 5 s, which begin with the T-pose
  All,        ///< fitted to the labelled markers of the whole clip
  Live,       ///< the marker set; the daemon fits the body while it tracks, as for an unknown person
  Bound,      ///< the true body and the true labels: no run of the daemon, but skeleton_bound
};

/// In the order of SkeletonKnown.
inline constexpr std::string_view kSkeletonModes[] = {"given", "first5", "all", "live", "bound"};
std::optional<SkeletonKnown> skeleton_mode_named(std::string_view name);

/// Tracks, labels and solves a clip with noise, live. The points have no labels: other benchmarks of solvers give the
/// labels. The same arguments give the same figures, except the time. Fails with InvalidArgument if the body cannot be
/// fitted.
Result<SkeletonFigures> run_skeleton(const PosedClip& clip, SkeletonKnown mode, const PointNoise& noise,
                                     std::uint64_t seed);

}  // namespace mocap::benchmark
