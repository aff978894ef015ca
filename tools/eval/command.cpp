#include "eval/command.h"

namespace mocap::eval {

std::span<const Command> commands() {
  static constexpr Command kAll[] = {
      {"score", "compare a stream of snapshots with the truth", run_score},
      {"labels", "how right the names of a stream are", run_labels},
      {"skeleton", "how right the bones of a stream are", run_skeleton},
      {"scene", "how right names and skeletons are in a simulated scene", run_scene},
      {"points", "how well simulated cameras find markers in space", run_points},
      {"wand", "how right a calibration by a wand is", run_wand},
      {"drift", "whether a bumped camera is noticed, and mended", run_drift},
      {"paper", "rebuild the tracking study, and judge our trackers on its clips", run_paper},
  };
  return kAll;
}

}  // namespace mocap::eval
