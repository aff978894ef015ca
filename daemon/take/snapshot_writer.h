#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "module/writer.h"

namespace mocap::take {

/// Keeps snapshots in a file, in the form that its name asks for: `.jsonl`, one line a snapshot (wire/json.h), or
/// `.pb`, each snapshot as Protobuf (mocap.v1.Snapshot) with its length before it as a varint. The same snapshots give
/// the same bytes. What stood at `path` is replaced at once; the file grows as it is written, so that after a crash
/// all but the last snapshot can be read.
///
/// Fails with InvalidArgument (another ending) and Io. `write` and `finish` fail with Io; after a failed write the file
/// is not written to again, and each call gives that error.
Result<std::unique_ptr<Writer>> make_snapshot_writer(const std::filesystem::path& path);

}  // namespace mocap::take
