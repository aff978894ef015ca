#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

#include "base/result.h"

namespace mocap {

/// Returns all bytes of a file. Fails with NotFound, with Io if a part cannot be read (never returns a part), and with
/// InvalidArgument if the file has over `most_bytes` bytes. Streams do not tell the end of a file from an error, or
/// throw.
Result<std::string> read_file(const std::filesystem::path& path,
                              std::uint64_t most_bytes = std::numeric_limits<std::uint64_t>::max());

}  // namespace mocap
