#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "corpus/recording.h"

namespace mocap::corpus {

/// The results of the daemon's steps on one recording.
struct Figures {
  std::uint64_t sets = 0;    ///< snapshots
  std::uint64_t labels = 0;  ///< measured markers with a label, over all snapshots
  std::uint64_t filled = 0;  ///< markers whose position was predicted
  std::uint64_t judged = 0;  ///< measured markers at an exposure with a known truth
  std::uint64_t wrong = 0;   ///< of these: 20 mm or more from the marker of their label
  double rms = 0.0;          ///< error of the others, mm
  std::uint64_t read = 0;    ///< snapshots that the subscriber of the feed has read
  std::uint64_t taken = 0;   ///< snapshots in the takes that ended or were repaired
  std::uint64_t hash = 0;    ///< of all snapshots as bytes of the wire
  std::string fault;         ///< an invariant of feed or takes that does not hold; empty: none
};

/// Runs the daemon's steps (chaos::StepDaemon), the feed and the takes on a recording. `world`: the folder of rig and
/// marker sets. Fails if a file of the world cannot be read or a recording names a camera or subject that it lacks.
Result<Figures> figures_of(const Recording& recording, const std::filesystem::path& world);

}  // namespace mocap::corpus
