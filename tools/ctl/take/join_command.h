#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Chunks that become one take.
struct JoinLine {
  std::filesystem::path out = {};                  ///< the joined take
  std::vector<std::filesystem::path> chunks = {};  ///< files or folders; none: the chunk folder of `out`
  std::uint32_t count = 0;                         ///< only the chunks 1-of-count to count-of-count of it; 0: all in it
  bool remove_chunks = false;                      ///< once they are joined
  bool resume = false;
  bool json = false;
};

/// Joins chunks and prints what was found at the seams. Returns the exit code. Ends the program by a signal that came
/// meanwhile.
int join_chunks(const JoinLine& line);

/// Adds `take join` to the command `take`. `chosen`: set when the command line has it.
void add_join_command(cli::App& take, std::function<int()>& chosen);

}  // namespace mocap::ctl
