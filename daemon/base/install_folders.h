#pragma once

#include <filesystem>

namespace mocap {

/// The folders of an installation, seen from the program PREFIX/bin/NAME. The build tree has the same layout, so that a
/// program finds its files before and after the installation, under any prefix and in any working directory.
struct InstallFolders {
  std::filesystem::path data;     ///< PREFIX/share/mocapd: marker sets, skeletons, scenes, example configurations
  std::filesystem::path plugins;  ///< PREFIX/lib/mocapd: libraries that a program loads when it needs them
};

/// The folders for the program file `program` (absolute path, no symbolic link). Both paths are empty if `program` is.
InstallFolders install_folders_of(const std::filesystem::path& program);

/// The folders of the running program. Both paths are empty if /proc is not mounted.
const InstallFolders& install_folders();

}  // namespace mocap
