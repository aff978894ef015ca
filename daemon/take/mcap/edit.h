#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "base/result.h"
#include "take/mcap/records.h"
#include "take/mcap/scan.h"

namespace mocap::take::mcap {

/// Adds a metadata record to a complete file, without writing its messages again: the record and a new index replace
/// the old index. At each instant the file on the disk has all its messages; after a crash the index or the new record
/// may be missing (repair_file). Fails with Busy (another process writes the file), NotFound, InvalidArgument (no valid
/// index: repair first) and Io; a full disk leaves the file as it was.
Status add_metadata(const std::filesystem::path& path, const Metadata& metadata);

/// Adds the metadata that `make` returns while no other process changes the file: `make` can read there what it
/// changes. Fails as `make` does, too; the file is then as it was.
Status add_metadata(const std::filesystem::path& path, const std::function<Result<Metadata>()>& make);

/// The result of `repair_file`: what it kept and left out.
struct Repair {
  std::uint64_t messages = 0;
  std::uint64_t lost_bytes = 0;  ///< of the old file: behind its last whole record, or damaged
  std::vector<Damage> damages;   ///< in the old file
};

/// Replaces a file without a valid index, or with damaged chunks, by a file with all its valid records and an index.
/// The new file is written beside the old one under another name, flushed to the disk and renamed: the path is always
/// the old or the new file. Fails with Busy, NotFound, InvalidArgument (not an MCAP file) and Io.
Result<Repair> repair_file(const std::filesystem::path& path);

/// The faults of a file: damaged records, checksums (also of the whole data section), index entries that disagree with
/// the data. Empty: the file is valid. Fails as Reader::open.
Result<std::vector<Damage>> verify_file(const std::filesystem::path& path);

}  // namespace mocap::take::mcap
