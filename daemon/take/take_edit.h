#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "take/mcap/edit.h"
#include "take/take_info.h"

namespace mocap::take {

/// Changes of the info of a take; an absent member stays.
struct TakeEdit {
  std::optional<std::string> name;
  std::optional<std::string> slate;
  std::optional<std::uint32_t> number;
  std::optional<std::string> notes;
  std::optional<std::vector<std::string>> tags;
  std::optional<int> rating;
};

/// Changes the info of a complete take, without writing its messages again; two edits at once lose no change: one of
/// them may fail with Busy. Returns the new info. Fails as
/// mcap::add_metadata and as `check`.
Result<TakeInfo> edit_take(const std::filesystem::path& path, const TakeEdit& edit);

/// Writes the index of a take that was cut off, or leaves out its damaged chunks (mcap::repair_file), and notes in the
/// info that the take was repaired and when its last message is. Fails as mcap::repair_file and TakeReader::open.
Result<mcap::Repair> repair_take(const std::filesystem::path& path);

/// The faults of a take: those of the file (mcap::verify_file), and messages that cannot be decoded. Empty: valid.
Result<std::vector<mcap::Damage>> verify_take(const std::filesystem::path& path);

/// Renames the file of a take within its folder, and never replaces another file. Returns the new path. Fails with
/// InvalidArgument (a name with '/', or the name exists: the message names the next free name), and with Io.
Result<std::filesystem::path> rename_take(const std::filesystem::path& path, const std::string& name);

}  // namespace mocap::take
