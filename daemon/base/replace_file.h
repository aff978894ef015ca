#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace mocap {

/// Replaces the text of a file atomically: a reader finds the old text or the new text, also after a power failure. The
/// text is written to a temporary file beside it, flushed to the disk and renamed. Fails with Io; the old file is then
/// unchanged.
Status replace_file(const std::filesystem::path& path, std::string_view text);

}  // namespace mocap
