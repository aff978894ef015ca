#include "base/install_folders.h"

#include <system_error>

namespace mocap {

InstallFolders install_folders_of(const std::filesystem::path& program) {
  if (program.empty()) return {};
  const std::filesystem::path prefix = program.parent_path().parent_path();
  return {prefix / "share" / "mocapd", prefix / "lib" / "mocapd"};
}

const InstallFolders& install_folders() {
  static const InstallFolders folders = [] {
    std::error_code failed;
    return install_folders_of(std::filesystem::read_symlink("/proc/self/exe", failed));
  }();
  return folders;
}

}  // namespace mocap
