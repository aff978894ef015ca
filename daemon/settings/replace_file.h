#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace mocap::settings {

/// Writes a file so that whoever opens it, also after a power cut, finds the old text or the new one, never half of
/// either: to a temporary file beside it, flushed to the disk and renamed. Fails with Io; the old file is then as it
/// was.
Status replace_file(const std::filesystem::path& path, std::string_view text);

}  // namespace mocap::settings
