#pragma once

#include <filesystem>

namespace mocap {

/// Waits until the disk has the names in the folder of `path`: without it, a power failure can lose a file that was
/// created or renamed, although its content was flushed. Not every file system supports it; that is ignored.
void sync_folder_of(const std::filesystem::path& path);

}  // namespace mocap
