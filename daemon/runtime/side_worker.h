#pragma once

#include <memory>
#include <vector>

#include "model/description.h"
#include "module/writer.h"
#include "runtime/fusion_worker.h"
#include "runtime/pausable.h"
#include "runtime/report/counters.h"
#include "runtime/report/recording_progress.h"

namespace mocap::runtime {

/// A writer of the side thread, with its progress if it is a recording.
class SideFile {
 public:
  explicit SideFile(std::unique_ptr<Writer> writer);

  bool is_recording() const { return writer_->wants_snapshots(); }
  const RecordingProgress& progress() const noexcept { return progress_; }
  /// Describes, fits, snapshots: as Writer. A failure is logged; it ends a recording.
  void describe(const Description& description);
  void learn(const SubjectFit& fit);
  void write(const Snapshot& snapshot, SideCounters& counters);
  /// Flushes and ends the file, if no write failed before.
  void finish();

 private:
  std::unique_ptr<Writer> writer_;
  RecordingProgress progress_;
};

/// The side thread: writes snapshots and fits of subjects to files. If the disk is too slow, snapshots are missing in
/// the file (counted by the fusion thread), never in the feed. A recording ends with its first failed write.
class SideWorker : public Pausable {
 public:
  /// The channel outlives the worker. `lossless`: the fusion thread waits for free space, and this thread signals it.
  SideWorker(std::vector<std::unique_ptr<Writer>> writers, bool lossless, SnapshotChannel& channel,
             SideCounters& counters);

  /// The loop; returns when the fusion thread has ended and all its snapshots and fits are written and flushed, or when
  /// it is paused and all that waited are written.
  void run();

  /// The new writers and the files that end.
  struct Change {
    std::vector<std::unique_ptr<Writer>> writers;
    bool recordings_continue = false;          ///< the recordings go on in their files
    const Description* description = nullptr;  ///< not null; for the snapshots from its version on
    SnapshotChannel* channel = nullptr;        ///< not null
  };
  /// Continues with other writers. Returns the files that end; the caller calls SideFile::finish for each. Call while
  /// no thread is in `run`.
  std::vector<std::unique_ptr<SideFile>> change(Change change);

  /// The recordings; they live as long as the worker, or until `change` ends them.
  std::vector<const RecordingProgress*> recordings() const;

 private:
  bool learn_fits();

  std::vector<std::unique_ptr<SideFile>> files_;
  bool lossless_;
  SnapshotChannel* channel_;
  SideCounters& counters_;
};

}  // namespace mocap::runtime
