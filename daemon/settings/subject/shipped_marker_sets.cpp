#include "settings/subject/shipped_marker_sets.h"

#include <filesystem>

#include "base/install_folders.h"
#include "base/list_folder.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::settings {

std::vector<MarkerSet> load_shipped_marker_sets() {
  std::vector<MarkerSet> sets;
  for (const std::filesystem::path& file : list_folder(install_folders().data / "markersets").paths) {
    if (file.extension() != ".toml") continue;
    if (auto set = load_marker_set(file)) sets.push_back(*std::move(set));
  }
  return sets;
}

}  // namespace mocap::settings
