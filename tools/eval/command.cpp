#include "eval/command.h"

namespace mocap::eval {

std::span<const Command> commands() {
  static constexpr Command kAll[] = {
      {"score", "compare a stream of snapshots with the truth", run_score},
      {"paper", "rebuild the tracking study, and judge our trackers on its clips", run_paper},
  };
  return kAll;
}

}  // namespace mocap::eval
