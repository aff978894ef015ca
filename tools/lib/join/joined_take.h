#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include "base/result.h"
#include "base/time.h"
#include "lib/join/chunk_takes.h"
#include "lib/retrack/part_take.h"
#include "mocap/v1/snapshot.pb.h"
#include "take/take_quality.h"

namespace mocap::join {

/// Writes the take that chunks become.
class JoinedTake {
 public:
  /// With the files of the first chunk. The chunks outlive the object. Fails as PartTake::create does.
  static Result<JoinedTake> create(const std::filesystem::path& path, const ChunkTakes& takes);

  /// Images, health and events of the chunks up to an instant, included, that are not written yet.
  Status append_others(Timestamp up_to);
  /// A snapshot, behind all that was before it. `chunk`: index of its chunk; `description`: that it refers to.
  Status append(v1::Snapshot snapshot, std::size_t chunk, const Description& description);

  /// Writes what is left. Returns the path. Fails as PartTake::finish does.
  Result<std::string> finish();

 private:
  JoinedTake(retrack::PartTake file, const take::TakeStart& start, const ChunkTakes& takes);
  void open_others();
  Status append_other(const take::TakeRecord& record);
  Status describe(const Description& description, std::size_t chunk, Timestamp at);

  retrack::PartTake file_;
  take::TakeInfo info_;
  const ChunkTakes& takes_;
  std::size_t chunk_ = 0;                   // whose other messages are being read
  std::optional<take::TakeCursor> others_;  // nothing: those of all chunks are read
  std::optional<take::TakeRecord> waiting_;
  // Of the description in force: its chunk and its version there; its version in the joined take.
  std::optional<std::pair<std::size_t, std::uint32_t>> described_;
  std::uint32_t version_ = 0;
  std::size_t cameras_ = 0;
  take::TakeMeter meter_;
};

}  // namespace mocap::join
