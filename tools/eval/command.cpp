#include "eval/command.h"

namespace mocap::eval {

std::span<const Command> commands() {
  static constexpr Command kAll[] = {
      {"score", "compare a stream of snapshots with the truth", run_score},
  };
  return kAll;
}

}  // namespace mocap::eval
