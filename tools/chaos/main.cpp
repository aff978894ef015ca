// mocap-chaos: runs the daemon's steps with drawn faults. See --help.
#include <fmt/core.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include "base/exit_codes.h"
#include "base/log.h"
#include "chaos/report.h"
#include "chaos/seed_batch.h"
#include "lib/cli/app.h"

namespace mocap::chaos {
namespace {

constexpr const char* kHelp =
    "Runs the steps of the daemon (clocks, 2D tracks, alignment, fusion, feed, takes, reload) in one thread under a\n"
    "virtual clock, with a simulated world and with faults that are drawn from the seed. After each step the "
    "invariants\n"
    "of tools/chaos/README.md are checked. The same seed gives the same run. A failure is printed with its seed,\n"
    "commit, step, invariant and the fewest faults that still fail.\n"
    "\n"
    "exit codes: 0 all hold, 65 an invariant does not hold.\n"
    "\n"
    "examples:\n"
    "  mocap-chaos 42\n"
    "      one seed\n"
    "  mocap-chaos --seeds 1..200\n"
    "      200 seeds, two at once\n"
    "  mocap-chaos 1 --minutes 60 --json\n"
    "      as many seeds as an hour permits, from 1 on\n";

struct Options {
  std::optional<std::uint64_t> seed;
  std::string seeds;
  std::optional<double> minutes;
  int jobs = 2;
  bool json = false;
  bool whole = false;
};

// In memory, where it exists: the takes of an episode wait for the disk 20 times a second.
std::filesystem::path default_folder() {
  const std::filesystem::path memory = "/dev/shm";
  std::error_code ignored;
  return std::filesystem::is_directory(memory, ignored) ? memory : std::filesystem::temp_directory_path();
}

// Reads A..B. Nothing: no such text.
std::optional<BatchSettings> read_seeds(const std::string& text) {
  const std::size_t dots = text.find("..");
  if (dots == std::string::npos) return std::nullopt;
  const std::string first = text.substr(0, dots), last = text.substr(dots + 2);
  const auto is_number = [](const std::string& word) {
    return !word.empty() && word.size() < 19 && word.find_first_not_of("0123456789") == std::string::npos;
  };
  if (!is_number(first) || !is_number(last)) return std::nullopt;
  BatchSettings batch;
  batch.first = std::stoull(first);
  batch.last = std::stoull(last);
  if (batch.first > batch.last) return std::nullopt;
  return batch;
}

int run(const Options& options, BatchSettings batch) {
  set_log_level(LogLevel::Error);
  batch.jobs = options.jobs;
  batch.folder = default_folder();
  if (options.minutes)
    batch.no_start_after = std::chrono::round<Duration>(std::chrono::duration<double>(60.0 * *options.minutes));
  const std::string commit = commit_of_tree();
  std::uint64_t failures = 0, sets = 0;
  const auto on_result = [&](const SeedResult& result) {
    sets += result.verdict.sets;
    if (!result.verdict.failure) return;
    ++failures;
    const auto smallest = options.whole ? Result<SeedResult>(result) : shrink_failure(result, batch.folder);
    const SeedResult& shown = smallest ? *smallest : result;
    fmt::print("{}\n", options.json ? failure_json(shown, commit) : failure_text(shown, commit));
    std::fflush(stdout);
  };
  const Result<std::uint64_t> ran = run_seeds(batch, on_result);
  if (!ran) {
    fmt::print(stderr, "mocap-chaos: {}\n", ran.error().message);
    return kExitUnavailable;
  }
  if (options.json) {
    fmt::print("{{\"seeds\": {}, \"failures\": {}, \"sets\": {}, \"commit\": \"{}\"}}\n", *ran, failures, sets, commit);
  } else {
    fmt::print("{} seeds, {} sets, {} failures\n", *ran, sets, failures);
  }
  return failures == 0 ? kExitOk : kExitData;
}

int main_of(int argc, const char* const* argv) {
  Options options;
  cli::App app("finds faults of the daemon by simulation: drawn disturbances, virtual time", "mocap-chaos");
  auto* seed = app.add_option("seed", options.seed, "the first seed; without --minutes, the only one");
  app.add_option("--seeds", options.seeds, "seeds A..B, both included")->excludes(seed);
  app.add_option("--minutes", options.minutes, "no further seed is started after this time")
      ->check(cli::Range(0.001, 1e5));
  app.add_option("--jobs", options.jobs, "seeds at once, each in a process of its own")
      ->check(cli::Range(1, 64))
      ->capture_default_str();
  app.add_flag("--whole", options.whole, "does not search for the fewest faults that still fail");
  app.add_flag("--json", options.json, "one line of JSON for each failure, and one for the end");
  app.footer(kHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  std::optional<BatchSettings> batch = read_seeds(options.seeds);
  if (!options.seeds.empty() && !batch) {
    return app.fail("--seeds: '" + options.seeds + "', expected two numbers A..B, the first not above the second");
  }
  if (!batch) {
    if (!options.seed) return app.fail("a seed, or --seeds A..B, is needed");
    batch = BatchSettings{};
    batch->first = *options.seed;
    batch->last = options.minutes ? std::numeric_limits<std::uint64_t>::max() : *options.seed;
  }
  return run(options, *std::move(batch));
}

}  // namespace
}  // namespace mocap::chaos

int main(int argc, char** argv) { return mocap::chaos::main_of(argc, argv); }
