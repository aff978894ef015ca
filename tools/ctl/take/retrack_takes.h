#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace mocap::ctl {

/// Several takes that are tracked again by one command.
struct RetrackTakes {
  std::vector<std::filesystem::path> takes = {};
  std::filesystem::path out_dir = {};     ///< empty: the current folder
  std::filesystem::path out = {};         ///< the new take, if there is one take; empty: its default name
  std::uint32_t chunks = 0;               ///< each take is tracked in so many, which are joined; 0: it is not cut
  std::vector<std::string> options = {};  ///< for the command of each take
  int jobs = 0;           ///< takes or chunks at a time; 0: one for each processor, or as the farm decides
  std::string farm = {};  ///< slurm, parallel or openjd; empty: processes of this machine
  bool dry_run = false;   ///< writes the files of the farm, and runs nothing
  bool resume = false;    ///< goes on with an earlier run
  bool json = false;
  bool progress = false;  ///< print lines "progress SHARE" to standard error
};

/// Tracks the takes, shows the progress of all of them, and prints one line for each. Returns the exit code: that of
/// the first failure. Ends the program by a signal that came meanwhile.
int retrack_takes(const RetrackTakes& order);

}  // namespace mocap::ctl
