#pragma once

#include <memory>
#include <vector>

#include "model/skeleton.h"
#include "module/skeleton_solver.h"
#include "solve/solve_settings.h"

namespace mocap::solve {

/// Inverse kinematics over each subject's tree: all named markers that were seen in this set pull on their bones at
/// once, from the pose that the last set's motion leads to, each by its covariance and by the skin under it. A marker
/// that one camera alone sees pulls along its ray; its label is Filled, on the ray, where the body has it.
///
/// A bone whose own markers were seen is Measured, every other one Filled. What no marker tells goes on for a moment
/// and then stays. Where markers come and go and the body turns out to be elsewhere, the bones that are shown glide
/// there within 0.2 s (body/ease_pose.h); labels do not.
///
/// Allocates here only. One thread owns it.
std::unique_ptr<SkeletonSolver> make_skeleton_solver(const SolveSettings& settings, std::vector<Subject> subjects);

}  // namespace mocap::solve
