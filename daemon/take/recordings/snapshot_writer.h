#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "model/description.h"
#include "module/writer.h"

namespace mocap::take {

/// Writes snapshots to a file. The extension selects the format: `.jsonl`, one line of JSON for each snapshot
/// (wire/codec/json.h), or `.pb`, each snapshot as Protobuf (mocap.v1.Snapshot) after its length as a varint. Equal
/// snapshots and descriptions give equal bytes. An existing file is kept, and the new one has a number in its name
/// (OutputFile::create). Snapshots are written in pieces of 64 KiB, so a crash loses at most the last piece.
///
/// The first snapshot has `description`, which has the names, in its field `description`; so does the first snapshot
/// after each fit that was passed to `learn` and after each call of `describe`.
///
/// Fails with InvalidArgument (another extension) and Io. `write` and `finish` fail with Io; after a failed write the
/// file ends with the last whole snapshot, and each call returns the error of that write.
Result<std::unique_ptr<Writer>> make_snapshot_writer(const std::filesystem::path& path, Description description);

}  // namespace mocap::take
