#pragma once

#include <cstdint>
#include <vector>

#include "lib/scoring/frames.h"
#include "lib/simworld/scene_actors.h"

namespace mocap::simworld {

/// Which of the subjects is which of the actors, where nothing tells them apart: subjects of one marker set whose
/// bodies the daemon does not know take each other's places freely, until one is named; then he is whom he was named
/// on for good.
class Recognition {
 public:
  explicit Recognition(const std::vector<Performer>& performers);

  /// Puts the actors' numbers for the subjects'.
  void apply(const scoring::EvalFrame& truth, scoring::EvalFrame& said);

 private:
  void recognise(std::uint32_t subject, const scoring::EvalFrame& truth, const scoring::EvalFrame& said);

  static constexpr std::uint32_t kNobody = 0xFFFF'FFFF;
  std::vector<std::vector<std::uint32_t>> may_be_;  // by subject; empty: himself alone
  std::vector<std::uint32_t> actor_of_;             // by subject; kNobody: not named yet
};

}  // namespace mocap::simworld
