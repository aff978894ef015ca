#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "module/timecode_source.h"
#include "runtime/fusion_worker.h"

namespace mocap::runtime {

/// The timecode thread: listens to the source of timecode, passes its state to the threads that need it, and logs
/// changes.
class TimecodeWorker {
 public:
  /// `channel` outlives the worker.
  TimecodeWorker(std::unique_ptr<TimecodeSource> source, TimecodeChannel& channel);

  /// The loop; returns when stopped.
  void run(const std::stop_token& stop);

 private:
  void report(const TimecodeHealth& state);

  std::unique_ptr<TimecodeSource> source_;
  TimecodeChannel& channel_;
  std::optional<TimecodeState> reported_;
};

}  // namespace mocap::runtime
