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
#include "lib/cli/status_line.h"

namespace mocap::chaos {
namespace {

constexpr const char* kHelp =
    "Runs the steps of the daemon (clocks, 2D tracks, alignment, fusion, feed, takes, reload) in one thread under a\n"
    "virtual clock, with a simulated world and with faults that are drawn from the seed. After each step the "
    "invariants\n"
    "of tools/chaos/README.md are checked. The same seed gives the same run. A failure is printed with its seed,\n"
    "commit, step, invariant and the fewest faults that still fail. Progress is on standard error.\n"
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

// "400 of 10000 seeds, 1 failures, 55 s" on standard error: overwritten on a terminal, a line a minute in a file.
class Progress {
 public:
  explicit Progress(const BatchSettings& batch) : batch_(batch) {}

  void show(std::uint64_t seeds, std::uint64_t failures) {
    const auto now = std::chrono::steady_clock::now();
    if (!line_.on_terminal() && now - shown_at_ < std::chrono::minutes(1)) return;
    shown_at_ = now;
    const std::string of = batch_.no_start_after ? "" : fmt::format(" of {}", batch_.last - batch_.first + 1);
    const std::string text = fmt::format("{}{} seeds, {} failures, {} s", seeds, of, failures,
                                         std::chrono::duration_cast<std::chrono::seconds>(now - began_).count());
    if (line_.on_terminal()) return line_.show(text);
    fmt::print(stderr, "{}\n", text);
  }
  void clear() { line_.clear(); }

 private:
  BatchSettings batch_;
  cli::StatusLine line_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now(), shown_at_ = began_;
};

int run(const Options& options, BatchSettings batch) {
  set_log_level(LogLevel::Error);
  batch.jobs = options.jobs;
  batch.folder = default_folder();
  if (options.minutes)
    batch.no_start_after = std::chrono::round<Duration>(std::chrono::duration<double>(60.0 * *options.minutes));
  const std::string commit = commit_of_tree();
  std::uint64_t seeds = 0, failures = 0, sets = 0;
  Progress progress(batch);
  const auto on_result = [&](const SeedResult& result) {
    sets += result.verdict.sets;
    failures += result.verdict.failure ? 1 : 0;
    progress.show(++seeds, failures);
    if (!result.verdict.failure) return;
    const auto smallest = options.whole ? Result<SeedResult>(result) : shrink_failure(result, batch.folder);
    const SeedResult& shown = smallest ? *smallest : result;
    progress.clear();
    fmt::print("{}\n", options.json ? failure_json(shown, commit) : failure_text(shown, commit));
    std::fflush(stdout);
  };
  const Result<std::uint64_t> ran = run_seeds(batch, on_result);
  progress.clear();
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
