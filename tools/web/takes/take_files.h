#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/result.h"

// The takes of a folder, as the page needs them. Each function reads or writes files and may take long.
namespace mocap::web {

inline constexpr std::size_t kMaxTakesListed = 500;

/// The file of the take `name` in `folder`. Fails with InvalidArgument (the name cannot be that of a file in the
/// folder) and NotFound. A symbolic link is not a take.
Result<std::filesystem::path> take_file(const std::filesystem::path& folder, const std::string& name);

/// {"folder","takes":[...],"left_out"}: the newest takes first, at most kMaxTakesListed. Fails with NotFound and Io.
Result<nlohmann::ordered_json> list_takes(const std::filesystem::path& folder);

/// All that is known of a take, with its quality. Fails as take::TakeReader::open.
Result<nlohmann::ordered_json> show_take(const std::filesystem::path& file);

/// {"valid","faults":[...]}. Reads the whole take.
Result<nlohmann::ordered_json> verify_take(const std::filesystem::path& file);

/// Executes "edit" (notes, rating, tags, slate, number; what is absent stays), "rename" (name) or "delete" with the
/// parameters as JSON. Returns a sentence for the operator. Fails with InvalidArgument (the message names the fault),
/// Busy (the take is being recorded) and Io.
Result<std::string> change_take(const std::filesystem::path& file, std::string_view verb, const std::string& params);

/// Whether `change_take` knows the verb.
bool is_take_change(std::string_view verb);

/// Snapshots of a take from `from_s` after its start, for at most `seconds` and at most 4 MiB, and the descriptions
/// that they refer to. Each message: length of the rest (4 bytes, little-endian), 'd' or 's', seconds since the start
/// of the take (double, little-endian), message. The first is the description in force.
Result<std::string> take_piece(const std::filesystem::path& file, double from_s, double seconds);

}  // namespace mocap::web
