#pragma once

#include <memory>
#include <vector>

#include "model/skeleton.h"
#include "module/skeleton_solver.h"

namespace mocap::stages {

struct SolveSettings {
  double marker_sigma_m = 0.003;  ///< how far a marker strays from its place on the bone: skin, suit
  double outlier_m = 0.05;        ///< a marker further off its place than this hardly counts
  double fill_for_s = 2.0;        ///< how long a marker that nobody sees is told by the body
  int max_iterations = 6;         ///< of a set; a first pose has ten times as many
};

/// Inverse kinematics over each subject's tree: all named markers that were seen in this set pull on their bones at
/// once, from the pose that the last set's motion leads to.
///
/// A bone whose own markers were seen is Measured, every other one Filled.
///
/// Allocates here only. One thread owns it.
std::unique_ptr<SkeletonSolver> make_skeleton_solver(const SolveSettings& settings, std::vector<Subject> subjects);

}  // namespace mocap::stages
