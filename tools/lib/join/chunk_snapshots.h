#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "base/time.h"
#include "lib/join/chunk_takes.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "take/take_reader.h"

namespace mocap::join {

/// The snapshots of a part of a chunk, in the order of their times. The chunk outlives the object.
class ChunkSnapshots {
 public:
  ChunkSnapshots(const ChunkTake& chunk, const retrack::Span& part);

  /// The next snapshot; nothing at the end. Fails with InvalidArgument (a damaged file, snapshots that are not in the
  /// order of their times, or one without its description) and Io; the message names the file.
  Result<std::optional<v1::Snapshot>> next();

  /// The description to which the last snapshot refers. Precondition: there was one.
  const Description& description() const { return *description_; }

 private:
  Result<std::optional<v1::Snapshot>> read_snapshot(const take::TakeRecord& record);

  Error wrong(const v1::Snapshot& snapshot, const char* what) const;
  Error in_file(const Error& error) const;

  const std::string& path_;
  take::TakeCursor cursor_;
  Timestamp from_;
  std::optional<Description> description_;
  Timestamp last_ = Timestamp::min();
};

/// When a set was exposed.
inline Timestamp time_of(const v1::Snapshot& snapshot) { return from_ns(snapshot.instants().exposed_at_ns()); }

}  // namespace mocap::join
