#pragma once

#include <cstdint>
#include <vector>

#include "lib/scoring/frames.h"
#include "lib/simworld/scene_actors.h"

namespace mocap::simworld {

/// Maps the subjects of the daemon to the actors of the scene. Subjects with the same marker set and no stored body are
/// interchangeable for the daemon. Such a subject is mapped to the nearest free actor when it has at least 5 measured
/// labels; the mapping then never changes.
class Recognition {
 public:
  explicit Recognition(const std::vector<Performer>& performers);

  /// Replaces the subject numbers in `reported` with actor numbers. Removes subjects that are not mapped yet.
  void apply(const scoring::EvalFrame& truth, scoring::EvalFrame& reported);

 private:
  void recognise(std::uint32_t subject, const scoring::EvalFrame& truth, const scoring::EvalFrame& reported);

  static constexpr std::uint32_t kNobody = 0xFFFF'FFFF;
  std::vector<std::vector<std::uint32_t>> may_be_;  // by subject: the actors that the subject may be
  std::vector<std::uint32_t> actor_of_;             // by subject; kNobody: not mapped yet
};

}  // namespace mocap::simworld
