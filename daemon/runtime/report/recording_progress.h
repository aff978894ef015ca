#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>

#include "base/result.h"
#include "model/health.h"
#include "module/recording_size.h"

namespace mocap::runtime {

/// Progress of one recording. The thread that writes the file updates it and logs each change of state; any thread
/// reads it.
class RecordingProgress {
 public:
  explicit RecordingProgress(std::string path) : path_(std::move(path)) {}

  const std::string& path() const noexcept { return path_; }
  RecordingState state() const noexcept { return state_.load(std::memory_order_acquire); }
  RecordingSize size() const noexcept {
    return {bytes_.load(std::memory_order_relaxed), records_.load(std::memory_order_relaxed)};
  }
  /// Call only if the state is Failed. Constant from then on.
  const std::string& error() const noexcept { return error_; }

  /// Notes the result of a write and the size after it. After an error the writer must not be called again.
  void wrote(const Status& written, RecordingSize size);

  /// Notes the result of the end of the file, if no write failed before.
  void finished(const Status& finished, RecordingSize size);

 private:
  const std::string path_;
  std::string error_;  // written before the state becomes Failed
  std::atomic<std::uint64_t> bytes_{0};
  std::atomic<std::uint64_t> records_{0};
  std::atomic<RecordingState> state_{RecordingState::Recording};
};

}  // namespace mocap::runtime
