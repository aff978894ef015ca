#pragma once

#include <memory>
#include <vector>

#include "model/skeleton.h"
#include "module/skeleton_solver.h"
#include "solve/solve_settings.h"

namespace mocap::solve {

/// Makes the solver of all subjects: inverse kinematics over the kinematic tree of each subject.
///
/// The pose of a set is the maximum a posteriori estimate (`SkeletonTracker`) from the pose that the motion predicts
/// and from all observations at once: measured markers, each with its covariance and the marker noise of the subject;
/// bearing-only observations; ambiguous observations. A marker with a bearing-only observation is Filled, at the point
/// of the ray that is nearest to the marker's position by the pose.
///
/// A bone is Measured if half of its own markers were, else Filled. An unobserved joint continues its motion for a
/// moment and then holds. If other markers observe a bone than before and the pose jumps, the published bones follow
/// the jump within 0.2 s (pose/pose_transition_smoother.h); the labels are not eased.
///
/// Allocates in this function only. The result is used by one thread and reads no clock.
std::unique_ptr<SkeletonSolver> make_skeleton_solver(const SolveSettings& settings, std::vector<Subject> subjects);

}  // namespace mocap::solve
