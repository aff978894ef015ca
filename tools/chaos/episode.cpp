#include "chaos/episode.h"

#include <algorithm>
#include <array>

namespace mocap::chaos {
namespace {

constexpr double kCalm_s = 1.5;    // people are found, the cameras' clocks are estimated
constexpr double kFaulty_s = 2.5;  // all faults lie in this time
constexpr double kJudged_s = 0.5;  // after the recovery
constexpr std::array kRates_hz{50.0, 50.0, 60.0, 60.0, 100.0};

}  // namespace

double end_of_faults_s(const Episode& episode) {
  double end_s = 0.0;
  for (const Fault& fault : episode.faults) end_s = std::max(end_s, fault.to_s());
  return end_s;
}

Episode draw_episode(std::uint64_t seed) {
  scene::Random random(scene::mixed(seed));
  Episode episode;
  episode.seed = seed;
  episode.cameras = 4 + static_cast<std::uint32_t>(random.uniform() * 3);
  episode.subjects = 1 + static_cast<std::uint32_t>(random.uniform() * 2);
  episode.rate_hz = kRates_hz[static_cast<std::size_t>(random.uniform() * kRates_hz.size())];
  episode.utc_stamps = random.uniform() < 0.3;
  episode.fitted = random.uniform() < 0.7;
  episode.patience = random.uniform() < 0.7 ? Episode{}.patience : std::chrono::milliseconds(2);
  episode.seconds = kCalm_s + kFaulty_s + kRecovery_s + kJudged_s;
  episode.faults =
      draw_faults(random, {episode.cameras, episode.subjects, kCalm_s, kCalm_s + kFaulty_s, FaultBounds{}.most});
  return episode;
}

}  // namespace mocap::chaos
