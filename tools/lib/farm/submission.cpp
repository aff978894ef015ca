#include "lib/farm/submission.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <system_error>

#include "base/list_folder.h"
#include "base/replace_file.h"

namespace mocap::farm {
namespace {

namespace fs = std::filesystem;

constexpr const char* kUnitScript = "unit.sh";

// "PATH SIZE bytes, modified SECONDS": changes if the file does. For a folder, its files.
std::string state_of(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    struct stat file {};
    if (::stat(path.c_str(), &file) != 0) return path.string() + " is absent";
    return fmt::format("{} {} bytes, modified {}.{:09}", path.string(), file.st_size, file.st_mtim.tv_sec,
                       file.st_mtim.tv_nsec);
  }
  std::vector<std::string> states;
  for (const fs::path& file : list_folder(path).paths) {
    if (fs::is_regular_file(file, error)) states.push_back(state_of(file));
  }
  return fmt::format("{}", fmt::join(states, "; "));
}

std::string without_newlines(std::string text) {
  std::ranges::replace(text, '\n', ' ');
  return text;
}

// Comments that change if a file does from which the new takes are made.
std::string states_of(const FarmOrder& order) {
  std::string states;
  const auto add = [&](const fs::path& path) { states += fmt::format("# {}\n", without_newlines(state_of(path))); };
  add(order.common.mocapctl);
  for (const std::string& option : order.common.options) {
    std::error_code error;
    if (option.starts_with('/') && fs::exists(option, error)) add(option);
  }
  for (const Unit& unit : order.units) add(unit.take);
  return states;
}

Result<fs::path> write(const fs::path& path, const std::string& text) {
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (const Status written = replace_file(path, text); !written) return written.error();
  return path;
}

Result<fs::path> write_unit_script(const FarmOrder& order) {
  return write(order.folder / kUnitScript, unit_script(order));
}

// In file names of Slurm, % begins a pattern.
std::string without_patterns(const std::string& path) {
  std::string text;
  for (const char c : path) text += c == '%' ? "%%" : std::string(1, c);
  return text;
}

// Whether a result is missing of a unit that ended well in an earlier run.
bool lacks_results(const FarmOrder& order) {
  for (std::size_t i = 0; i < order.units.size(); ++i) {
    std::error_code error;
    if (exit_code_of(order, i) == 0 && !fs::exists(file_of(order.units[i]), error) &&
        !fs::exists(order.units[i].out, error))
      return true;
  }
  return false;
}

}  // namespace

fs::path log_of(const FarmOrder& order, std::size_t unit) { return order.folder / fmt::format("{}.log", unit); }

fs::path exit_file_of(const FarmOrder& order, std::size_t unit) { return order.folder / fmt::format("{}.exit", unit); }

std::optional<int> exit_code_of(const FarmOrder& order, std::size_t unit) {
  std::ifstream file(exit_file_of(order, unit));
  int number = 0;
  if (file >> number) return number;
  return std::nullopt;
}

std::string shell_word(std::string_view text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

std::string shell_words(const std::vector<std::string>& words) {
  std::vector<std::string> quoted;
  for (const std::string& word : words) quoted.push_back(shell_word(word));
  return fmt::format("{}", fmt::join(quoted, " "));
}

std::string unit_script(const FarmOrder& order) {
  std::string cases;
  for (std::size_t i = 0; i < order.units.size(); ++i) {
    cases += fmt::format("    {}) {} ;;\n", i, shell_words(command_of(order.common, order.units[i])));
  }
  return fmt::format(R"(#!/bin/bash
# Tracks one take or chunk again, number $1 of those below. Its output is in $1.log and its exit code in $1.exit, both beside
# this file. Written by `mocapctl take retrack --farm`.
#
{states}
set -u
cd {folder} || exit 73

run() {{
  case "$1" in
{cases}    *) echo "unit.sh: unit is '$1', expected 0 to {last}"; return 64 ;;
  esac
}}

rm -f "$1.exit"
run "$1" >"$1.log" 2>&1
code=$?
# Ended by a signal, but not by the end of the job: a crash, or the kernel without memory.
if [ "$code" -gt 128 ] && [ "$code" -ne 130 ] && [ "$code" -ne 143 ]; then
  run "$1" >>"$1.log" 2>&1
  code=$?
fi
echo "$code" >"$1.exit.part" && mv "$1.exit.part" "$1.exit"
exit "$code"
)",
                     fmt::arg("states", states_of(order)), fmt::arg("folder", shell_word(order.folder.string())),
                     fmt::arg("cases", cases), fmt::arg("last", order.units.size() - 1));
}

Result<Submission> write_slurm(const FarmOrder& order) {
  const Result<fs::path> unit = write_unit_script(order);
  if (!unit) return unit.error();
  const std::string at_a_time = order.jobs > 0 ? fmt::format("%{}", order.jobs) : "";
  const Result<fs::path> script =
      write(order.folder / "array.sbatch", fmt::format(R"(#!/bin/bash
# One element of the array tracks one take or chunk again. Written by `mocapctl take retrack --farm slurm`. Partition, account
# and time limit come from the environment (SBATCH_PARTITION, SBATCH_ACCOUNT, SBATCH_TIMELIMIT).
#SBATCH --job-name=retrack
#SBATCH --array=0-{}{}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --requeue
#SBATCH --open-mode=append
exec /bin/bash {} "$SLURM_ARRAY_TASK_ID"
)",
                                                       order.units.size() - 1, at_a_time, shell_word(unit->string())));
  if (!script) return script.error();
  const std::string output = without_patterns((order.folder / "slurm-").string()) + "%a.log";
  return Submission{.files = {*script, *unit},
                    .command = {"sbatch", "--wait", "--output=" + output, script->string()},
                    .package = "slurm-client",
                    .cancels_jobs = true};
}

Result<Submission> write_parallel(const FarmOrder& order) {
  const Result<fs::path> unit = write_unit_script(order);
  if (!unit) return unit.error();
  // The jobs of the log are known by their number alone, so another list of takes has another log.
  const std::size_t digest = std::hash<std::string>()(unit_script(order));
  const fs::path log = order.folder / fmt::format("joblog-{:016x}", digest);
  std::error_code ignored;
  if (!order.resume || lacks_results(order)) fs::remove(log, ignored);
  const bool goes_on = fs::exists(log, ignored);
  std::vector<std::string> command{"parallel", "--will-cite", "--joblog", log.string(), "--resume-failed"};
  if (order.jobs > 0) command.insert(command.end(), {"--jobs", fmt::format("{}", order.jobs)});
  command.insert(command.end(), {"/bin/bash", shell_word(unit->string()), ":::"});
  for (std::size_t i = 0; i < order.units.size(); ++i) command.push_back(fmt::format("{}", i));
  return Submission{.files = {*unit}, .command = std::move(command), .package = "parallel", .goes_on = goes_on};
}

}  // namespace mocap::farm
