#include "runtime/report/recording_progress.h"

#include <fmt/format.h>

#include "base/log.h"

namespace mocap::runtime {

void RecordingProgress::wrote(const Status& written, RecordingSize size) {
  bytes_.store(size.bytes, std::memory_order_relaxed);
  records_.store(size.records, std::memory_order_relaxed);
  if (written) return;
  error_ = written.error().message;
  state_.store(RecordingState::Failed, std::memory_order_release);
  log_error("record", fmt::format("{}; the recording ends here, the feed continues: size={}B records={}; remove the "
                                  "cause (free some space), then reload or restart the daemon to record again",
                                  error_, size.bytes, size.records));
}

void RecordingProgress::finished(const Status& finished, RecordingSize size) {
  wrote(finished, size);
  if (!finished) return;
  state_.store(RecordingState::Ended, std::memory_order_release);
  log_info("record", fmt::format("'{}' ended, size={}B records={}", path_, size.bytes, size.records));
}

}  // namespace mocap::runtime
