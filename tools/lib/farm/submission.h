#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "lib/farm/unit.h"

namespace mocap::farm {

/// Units for a system that runs them, on this machine or others that see the same files under the same names.
struct FarmOrder {
  std::vector<Unit> units;
  UnitCommand common;            ///< its options have --resume, so that a unit may be run again
  std::filesystem::path folder;  ///< absolute: scripts, logs and exit codes of the units
  int jobs = 0;                  ///< units at a time; 0: as the system decides
  bool resume = false;           ///< goes on with an earlier run
};

/// Files that were written, and the command that runs the units of them.
struct Submission {
  std::vector<std::filesystem::path> files;
  std::vector<std::string> command;
  const char* package = "";   ///< Debian package of the command
  bool cancels_jobs = false;  ///< an end of the command does not end the units: scancel does
  bool goes_on = false;       ///< units that ended well in an earlier run are not begun again
};

/// The files of one unit in the folder of the farm: what it printed, and its exit code once it ended.
std::filesystem::path log_of(const FarmOrder& order, std::size_t unit);
std::filesystem::path exit_file_of(const FarmOrder& order, std::size_t unit);
/// Nothing: the unit has not ended.
std::optional<int> exit_code_of(const FarmOrder& order, std::size_t unit);

/// A word of a shell command.
std::string shell_word(std::string_view text);
std::string shell_words(const std::vector<std::string>& words);

/// The text of `unit.sh N`: runs unit N, once more if a signal ended it, and writes its log and its exit code.
std::string unit_script(const FarmOrder& order);

/// Writes an array script for Slurm: one element is one unit. Fails with Io.
Result<Submission> write_slurm(const FarmOrder& order);

/// Writes the script of the units for GNU parallel, which logs the jobs that ended. With `resume` a job that ended well
/// is not begun again, as long as takes, settings and options are unchanged. Fails with Io.
Result<Submission> write_parallel(const FarmOrder& order);

}  // namespace mocap::farm
