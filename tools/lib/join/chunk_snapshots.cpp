#include "lib/join/chunk_snapshots.h"

#include <fmt/format.h>

#include <utility>

namespace mocap::join {
namespace {

// From the beginning of the chunk on, because a description is in force until the next one.
take::TakeCursor messages_of(const ChunkTake& chunk, const retrack::Span& part) {
  take::TakeSelection selection{.topics = {take::TakeTopic::Snapshot, take::TakeTopic::Description}};
  if (part.to != Timestamp::max()) selection.to = part.to + Duration(1);
  return chunk.reader.messages(std::move(selection));
}

}  // namespace

ChunkSnapshots::ChunkSnapshots(const ChunkTake& chunk, const retrack::Span& part)
    : path_(chunk.reader.mcap().path()), cursor_(messages_of(chunk, part)), from_(part.from) {}

Error ChunkSnapshots::in_file(const Error& error) const {
  return {error.code, fmt::format("'{}': {}", path_, error.message)};
}

Error ChunkSnapshots::wrong(const v1::Snapshot& snapshot, const char* what) const {
  return in_file(
      {ErrorCode::InvalidArgument, fmt::format("set {} {}; track this chunk again", snapshot.number(), what)});
}

Result<std::optional<v1::Snapshot>> ChunkSnapshots::next() {
  for (;;) {
    const auto record = cursor_.next();
    if (!record) return record.error();
    if (!*record) return std::optional<v1::Snapshot>();
    if ((*record)->topic == take::TakeTopic::Description) {
      Result<Description> description = take::description_of(**record);
      if (!description) return in_file(description.error());
      description_ = *std::move(description);
    } else if ((*record)->at >= from_) {
      return read_snapshot(**record);
    }
  }
}

Result<std::optional<v1::Snapshot>> ChunkSnapshots::read_snapshot(const take::TakeRecord& record) {
  Result<v1::Snapshot> snapshot = take::snapshot_message_of(record);
  if (!snapshot) return in_file(snapshot.error());
  const Timestamp at = time_of(*snapshot);
  if (at != record.at || at <= last_) return wrong(*snapshot, "is not later than the one before it");
  if (!description_ || description_->version != snapshot->description_version()) {
    return wrong(*snapshot, "has no description");
  }
  last_ = at;
  return std::optional<v1::Snapshot>(*std::move(snapshot));
}

}  // namespace mocap::join
