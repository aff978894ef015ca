#pragma once

#include <filesystem>
#include <system_error>
#include <vector>

namespace mocap {

/// The contents of a folder, as far as it was read.
struct FolderContents {
  std::vector<std::filesystem::path> paths;  ///< files and folders in the folder, sorted
  std::error_code error;                     ///< why the folder, or the rest of it, was not read
};

/// Lists the files and folders in `folder`. Never throws when the disk fails or the folder disappears; a loop
/// `for (... : directory_iterator(folder, error))` does, because only its first step has the error code.
FolderContents list_folder(const std::filesystem::path& folder);

}  // namespace mocap
