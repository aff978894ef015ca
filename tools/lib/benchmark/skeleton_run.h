#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "lib/benchmark/point_noise.h"
#include "lib/benchmark/posed_clip.h"

namespace mocap::benchmark {

/// From what the bone lengths and marker offsets of the person are known.
enum class SkeletonKnown {
  Given,      ///< the true body
  FirstFive,  ///< fitted to the labelled markers of the first 5 s, which begin with the T-pose
  All,        ///< fitted to the labelled markers of the whole clip
  Live,       ///< of the marker set and what the daemon learns of it, as of an unknown person
};

/// In the order of SkeletonKnown.
inline constexpr std::string_view kSkeletonModes[] = {"given", "first5", "all", "live"};
std::optional<SkeletonKnown> skeleton_mode_named(std::string_view name);

/// Mean errors of one bone.
struct BoneFigures {
  std::string bone;
  double joint_cm = 0.0;
  double rotation_deg = 0.0;
};

/// Errors of the joints and bones, over all frames after the beginning of the clip in which the daemon has a pose. NaN
/// if it has none.
struct SkeletonFigures {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t frames = 0;        ///< scored frames
  double posed_share = 0.0;        ///< of these, with a pose
  double joint_cm = kNone;         ///< mean distance of a joint from its true position
  double joint_p99_cm = kNone;     ///< 99th percentile of these distances
  double rotation_deg = kNone;     ///< mean angle between a bone's rotation in the world and the true one
  std::vector<BoneFigures> bones;  ///< in the order of the skeleton; empty without a pose
  double ms_per_frame = 0.0;       ///< CPU time of the daemon's steps in this thread, mean
};

/// Tracks, labels and solves a clip with noise, live. The points have no labels: other benchmarks of solvers give the
/// labels. The same arguments give the same figures, except the time. Fails with InvalidArgument if the body cannot be
/// fitted.
Result<SkeletonFigures> run_skeleton(const PosedClip& clip, SkeletonKnown mode, const PointNoise& noise,
                                     std::uint64_t seed);

}  // namespace mocap::benchmark
