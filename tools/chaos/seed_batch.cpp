#include "chaos/seed_batch.h"

#include <poll.h>

#include <utility>
#include <vector>

#include "chaos/isolated_run.h"
#include "chaos/shrink.h"

namespace mocap::chaos {
namespace {

struct Running {
  Episode episode;
  IsolatedRun run;
};

// Waits until at least one run has ended. Returns the index of the first of them.
std::size_t wait_for_one(const std::vector<Running>& running) {
  std::vector<pollfd> files;
  for (const Running& one : running) files.push_back({one.run.file(), POLLIN, 0});
  for (;;) {
    ::poll(files.data(), files.size(), -1);
    for (std::size_t i = 0; i < files.size(); ++i) {
      if (files[i].revents != 0) return i;
    }
  }
}

Result<Verdict> run_isolated(const Episode& episode, const std::filesystem::path& folder) {
  Result<IsolatedRun> run = IsolatedRun::start(episode, folder);
  if (!run) return run.error();
  return run->finish();
}

}  // namespace

Result<std::uint64_t> run_seeds(const BatchSettings& settings,
                                const std::function<void(const SeedResult&)>& on_result) {
  const Timestamp begun = host_now();
  const auto may_start = [&] { return !settings.no_start_after || host_now() - begun < *settings.no_start_after; };
  std::vector<Running> running;
  std::uint64_t next = settings.first, done = 0;
  for (;;) {
    while (running.size() < static_cast<std::size_t>(settings.jobs) && next <= settings.last && may_start()) {
      Episode episode = draw_episode(next++);
      Result<IsolatedRun> run = IsolatedRun::start(episode, settings.folder);
      if (!run) return run.error();
      running.push_back({std::move(episode), *std::move(run)});
    }
    if (running.empty()) return done;
    const std::size_t ended = wait_for_one(running);
    Running one = std::move(running[ended]);
    running.erase(running.begin() + static_cast<std::ptrdiff_t>(ended));
    Result<Verdict> verdict = one.run.finish();
    if (!verdict) return verdict.error();
    ++done;
    on_result({std::move(one.episode), *std::move(verdict)});
  }
}

Result<SeedResult> shrink_failure(const SeedResult& failing, const std::filesystem::path& folder) {
  SeedResult smallest = failing;
  std::optional<Error> error;
  const auto fails = [&](const std::vector<Fault>& faults) {
    Episode episode = failing.episode;
    episode.faults = faults;
    Result<Verdict> verdict = run_isolated(episode, folder);
    if (!verdict) {
      error = verdict.error();
      return false;
    }
    const bool same = verdict->failure && verdict->failure->invariant == failing.verdict.failure->invariant;
    if (same) smallest = {episode, *std::move(verdict)};
    return same;
  };
  static_cast<void>(shrink(failing.episode.faults, fails));
  if (error) return *error;
  return smallest;
}

}  // namespace mocap::chaos
