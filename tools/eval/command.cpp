#include "eval/command.h"

namespace mocap::eval {

std::span<const Command> commands() {
  static constexpr Command kAll[] = {
      {"score", "compare a stream of snapshots with the truth", run_score},
      {"points", "how well simulated cameras find markers in space", run_points},
  };
  return kAll;
}

}  // namespace mocap::eval
