#include "settings/subject/shipped_marker_sets.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "base/install_folders.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::settings {

std::vector<MarkerSet> load_shipped_marker_sets() {
  std::vector<std::filesystem::path> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(install_folders().data / "markersets", ignored)) {
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  std::vector<MarkerSet> sets;
  for (const std::filesystem::path& file : files) {
    if (auto set = load_marker_set(file)) sets.push_back(*std::move(set));
  }
  return sets;
}

}  // namespace mocap::settings
