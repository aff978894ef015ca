#pragma once

#include "base/result.h"
#include "base/time.h"
#include "lib/join/chunk_takes.h"

namespace mocap::join {

/// Where the joined take goes over from one chunk to the next.
struct Seam {
  Timestamp at;              ///< the last set that is the earlier chunk's
  bool agrees = false;       ///< both chunks agree about this set
  int differing_labels = 0;  ///< in this set
};

/// Chooses a set of the overlap of two chunks. In the longest run of sets about which both agree (`agreement_of`): the
/// one where the fewest labels differ; of several the one nearest to the middle of the run. They agree about none: the
/// last set that both have. They have none in common: the end of the overlap. Fails as ChunkSnapshots does.
Result<Seam> find_seam(const ChunkTake& earlier, const ChunkTake& later, const retrack::Span& overlap);

}  // namespace mocap::join
