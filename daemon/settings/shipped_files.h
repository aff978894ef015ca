#pragma once

#include <filesystem>
#include <string>

namespace mocap::settings {

/// The result of a search for a file that a configuration or a command line names.
struct FoundFile {
  std::filesystem::path path;  ///< the file; the first place of the search if no place has the file
  /// "neither A nor B exists", or "A: no such file" if only one place was searched; empty if the file exists.
  std::string missing;
};

/// Searches a file first at `named` below `beside` (the folder of the naming file; empty: the working directory), then
/// at `named` below `shipped` (absolute; empty: unknown). An absolute `named` is searched in no other place, nor is a
/// path that leaves the folder above `shipped` by "..".
FoundFile find_file(const std::filesystem::path& named, const std::filesystem::path& beside,
                    const std::filesystem::path& shipped);

/// The same with the folder of the shipped files, share/mocapd.
FoundFile find_shipped(const std::filesystem::path& named, const std::filesystem::path& beside);

}  // namespace mocap::settings
