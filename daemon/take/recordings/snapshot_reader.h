#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "model/description.h"
#include "model/snapshot.h"

namespace mocap::take {

/// A snapshot of a recording, with what only the recording knows of it.
struct RecordedSnapshot {
  Snapshot snapshot;
  std::optional<std::int64_t> utc_minus_host_ns;
};

/// A mark that the operator set while a take was recorded.
struct RecordedMark {
  Timestamp at;  ///< host clock of the recording
  std::string text;
};

/// Why the snapshots of a recording may not be all that were to be recorded.
struct RecordingFaults {
  std::size_t damaged_parts = 0;  ///< of a take: left out
  bool cut_off = false;           ///< it has no end: its writer was stopped, or still writes
  bool being_written = false;     ///< its writer still writes
  /// Of a take: left out, because the description that they refer to was in a damaged part.
  std::size_t undescribed_snapshots = 0;
};

/// Reads the snapshots of a recording, one after the other.
class SnapshotReader {
 public:
  virtual ~SnapshotReader() = default;

  /// The next snapshot; its address is valid until the next call. Null at the end, also if the recording was cut off
  /// within its last snapshot. Of a take, a damaged chunk is left out, and each snapshot whose description was in one.
  /// Fails with InvalidArgument (the message names the byte or the line) and Io.
  virtual Result<const RecordedSnapshot*> next() = 0;

  /// The description that the last snapshot refers to. Its version changes when the description does.
  virtual const Description& description() const = 0;

  /// The marks of a take, in the order of their times, and the faults. Both are complete when next() returned null.
  virtual const std::vector<RecordedMark>& marks() const = 0;
  virtual const RecordingFaults& faults() const = 0;

  /// The share of the recording that was read, 0 to 1.
  virtual double progress() const = 0;
};

/// Opens a take (`.mcap`) or a recording of `make_snapshot_writer` (`.pb` or `.jsonl`). Fails with NotFound, Io,
/// Unsupported (a newer format) and InvalidArgument (another extension, or not a take).
Result<std::unique_ptr<SnapshotReader>> open_snapshots(const std::filesystem::path& path);

}  // namespace mocap::take
