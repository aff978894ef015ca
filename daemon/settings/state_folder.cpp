#include "settings/state_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "base/replace_file.h"
#include "settings/rig/rig_text.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

constexpr std::string_view kCredentials = "$CREDENTIALS_DIRECTORY/";

}  // namespace

StateFiles state_files(const std::filesystem::path& folder) {
  if (folder.empty()) return {};
  return {folder, folder / "added_subjects.toml", folder / "learnt_masks.toml", folder / "rig.toml"};
}

std::filesystem::path state_folder_of_service() {
  const char* folders = std::getenv("STATE_DIRECTORY");
  if (folders == nullptr) return {};
  const std::string_view all = folders;
  return all.substr(0, all.find(':'));
}

std::filesystem::path resolve_credential(const std::filesystem::path& path) {
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr || !is_unresolved_credential(path)) return path;
  return std::filesystem::path(folder) / path.string().substr(kCredentials.size());
}

bool is_unresolved_credential(const std::filesystem::path& path) { return path.string().starts_with(kCredentials); }

Status write_learnt_masks(const std::filesystem::path& path, const Rig& rig) {
  std::string text =
      "# Written by mocapd (mocapctl mask learn). Replaces the learnt masks of the rig file, camera by camera; without "
      "a\n"
      "# camera's table the masks of the rig file apply.\n";
  for (const CameraModel& camera : rig) {
    text += fmt::format("\n[{}]\nsize = [{}, {}]\n{} = {}\n", quoted_text(camera.name), camera.width_px,
                        camera.height_px, kLearntMask, mask_text(camera.learnt_masks));
  }
  return replace_file(path, text);
}

Result<std::vector<std::string>, Faults> read_learnt_masks(const std::filesystem::path& path, Rig& rig) {
  std::vector<std::string> notes;
  std::error_code ignored;
  if (path.empty() || !std::filesystem::exists(path, ignored)) return notes;
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return file.error();
  TomlTable root = file->root();
  for (const std::string& key : root.keys()) {
    std::optional<TomlTable> table = root.table(key, fmt::format("camera '{}'", key));
    if (!table) continue;
    const auto size = table->list("size", {2});
    auto masks = table->polygons(kLearntMask);
    table->done();
    if (!size || !masks) continue;
    const auto camera = std::ranges::find(rig, key, &CameraModel::name);
    if (camera == rig.end()) continue;  // a camera that the configuration has no more
    if ((*size)[0] != camera->width_px || (*size)[1] != camera->height_px) {
      notes.push_back(
          fmt::format("camera {}: the learnt masks of {} are for images of {}x{}, not {}x{}; they are left "
                      "out, learn them again (mocapctl mask learn)",
                      key, path.string(), (*size)[0], (*size)[1], camera->width_px, camera->height_px));
      continue;
    }
    camera->learnt_masks = *std::move(masks);
    notes.push_back(
        fmt::format("camera {}: learnt masks of {}, polygons={}", key, path.string(), camera->learnt_masks.size()));
  }
  if (!file->faults().list.empty()) return file->faults();
  return notes;
}

}  // namespace mocap::settings
