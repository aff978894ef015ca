#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "lib/join/seam.h"

namespace mocap::join {

struct JoinOrder {
  std::vector<std::filesystem::path> chunks;
  std::filesystem::path out;  ///< the joined take; ends in .mcap
  /// If `out` exists and is a whole joined take of these chunks, join() keeps it and does nothing; chunks may have been
  /// deleted. If `out` is another file, join() fails with InvalidArgument.
  bool resume = false;
};

struct JoinReport {
  std::string path;
  std::uint64_t sets = 0;
  Timestamp start;          ///< of the take
  std::vector<Seam> seams;  ///< one fewer than the chunks
  bool kept = false;        ///< the joined take was there already: nothing was done
};

/// Joins the chunks of a take that `retrack` tracked. The same chunks give the same bytes. One pass over the chunks to
/// compare the sets of their overlaps, and one to join them; memory of one set and of the indexes of all chunks.
///
/// Images, health and events are those of the chunk whose part without the overlap has their time. Snapshots go over
/// from one chunk to the next at a seam (`find_seam`): ids of tracks, numbers of sets and versions of descriptions go
/// on, and the poses do not jump (PoseOffset).
///
/// `progress`: share of the work, about once in 100 sets; false ends it. Fails as open_chunks and PartTake do, with
/// InvalidArgument if the file exists (and is not what `resume` is for) or a chunk is damaged, with EndOfStream if
/// `progress` ended it, and with Io.
Result<JoinReport> join(const JoinOrder& order, const std::function<bool(double)>& progress);

}  // namespace mocap::join
