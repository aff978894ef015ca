#pragma once

#include <memory>
#include <vector>

#include "module/writer.h"
#include "runtime/counters.h"
#include "runtime/fusion_worker.h"

namespace mocap::runtime {

/// The side thread: snapshots, and fits of subjects, to files. A disk that is too slow costs snapshots of the file
/// (counted by the fusion thread), never of the feed.
class SideWorker {
 public:
  /// The channel outlives the worker. `lossless`: the fusion waits for room and is told when there is some.
  SideWorker(std::vector<std::unique_ptr<Writer>> writers, bool lossless, SnapshotChannel& channel,
             SideCounters& counters);

  /// The loop; returns when the fusion has ended and all that it handed on is written and flushed. Never stops
  /// earlier, so that nothing is lost at the end.
  void run();

 private:
  bool learn_fits();
  void write(const Snapshot& snapshot);

  std::vector<std::unique_ptr<Writer>> writers_;
  bool lossless_;
  SnapshotChannel& channel_;
  SideCounters& counters_;
};

}  // namespace mocap::runtime
