#include "chaos/report.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "lib/cli/app.h"

namespace mocap::chaos {

std::string failure_text(const SeedResult& failing, const std::string& commit) {
  const Episode& episode = failing.episode;
  const Failure& failure = *failing.verdict.failure;
  std::string text = fmt::format(
      "seed {} fails at {:.3f} s, step {}, commit {}\n  invariant: {}\n  {}\n  {} cameras at {:.0f} Hz, {} subjects, "
      "{}\n",
      episode.seed, failure.t_s, failure.step, commit, failure.invariant, failure.words, episode.cameras,
      episode.rate_hz, episode.subjects, episode.utc_stamps ? "stamps in UTC" : "stamps of the cameras' own clocks");
  for (const Fault& fault : episode.faults) text += "  fault: " + to_text(fault) + "\n";
  return text;
}

std::string failure_json(const SeedResult& failing, const std::string& commit) {
  const Failure& failure = *failing.verdict.failure;
  nlohmann::json faults = nlohmann::json::array();
  for (const Fault& fault : failing.episode.faults) faults.push_back(to_text(fault));
  return nlohmann::json{
      {"seed", failing.episode.seed},   {"commit", commit},       {"t_s", failure.t_s}, {"step", failure.step},
      {"invariant", failure.invariant}, {"words", failure.words}, {"faults", faults}}
      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string commit_of_tree() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> git(::popen("git rev-parse --short=12 HEAD 2>/dev/null", "r"),
                                                            ::pclose);  // NOLINT(cert-env33-c): a constant
  char line[64] = {};
  if (git && std::fgets(line, sizeof line, git.get()) != nullptr) {
    std::string commit(line);
    while (!commit.empty() && commit.back() == '\n') commit.pop_back();
    return commit;
  }
  return cli::version_of("mocap-chaos");
}

}  // namespace mocap::chaos
