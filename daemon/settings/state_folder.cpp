#include "settings/state_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <string_view>

#include "base/replace_file.h"
#include "settings/rig/rig_text.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

constexpr std::string_view kCredentials = "$CREDENTIALS_DIRECTORY/";

// A table of a file of masks.
struct CameraMasks {
  std::string camera;
  double width_px = 0.0;  // of the images for which the masks are
  double height_px = 0.0;
  std::vector<MaskPolygon> polygons;
};

CameraMasks table_of(const CameraModel& camera, const MaskKind& kind) {
  return {camera.name, static_cast<double>(camera.width_px), static_cast<double>(camera.height_px), camera.*kind.of};
}

std::string text_of(const CameraMasks& table, const MaskKind& kind) {
  return fmt::format("\n[{}]\nsize = [{}, {}]\n{} = {}\n", quoted_text(table.camera), table.width_px, table.height_px,
                     kind.key, mask_text(table.polygons));
}

// Empty if there is no file.
Result<std::vector<CameraMasks>, Faults> tables_in(const std::filesystem::path& path, const MaskKind& kind) {
  std::vector<CameraMasks> all;
  std::error_code ignored;
  if (path.empty() || !std::filesystem::exists(path, ignored)) return all;
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return file.error();
  TomlTable root = file->root();
  for (const std::string& key : root.keys()) {
    std::optional<TomlTable> table = root.table(key, fmt::format("camera '{}'", key));
    if (!table) continue;
    const auto size = table->list("size", {2});
    auto masks = table->polygons(kind.key);
    table->done();
    if (size && masks) all.push_back({key, (*size)[0], (*size)[1], *std::move(masks)});
  }
  if (!file->faults().list.empty()) return file->faults();
  return all;
}

}  // namespace

StateFiles state_files(const std::filesystem::path& folder) {
  if (folder.empty()) return {};
  return {folder, folder / "added_subjects.toml", folder / "learnt_masks.toml", folder / "drawn_masks.toml",
          folder / "rig.toml"};
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

Status write_masks(const std::filesystem::path& path, const Rig& rig, const MaskKind& kind) {
  const auto before = tables_in(path, kind);
  if (!before) return Error{ErrorCode::InvalidArgument, to_text(before.error())};
  std::string text = fmt::format(
      "# Written by mocapd. Replaces the {} masks of the rig file, camera by camera; without a camera's table the\n"
      "# masks of the rig file apply.\n",
      kind.word);
  for (const CameraModel& camera : rig) text += text_of(table_of(camera, kind), kind);
  for (const CameraMasks& kept : *before) {
    if (std::ranges::find(rig, kept.camera, &CameraModel::name) == rig.end()) text += text_of(kept, kind);
  }
  return replace_file(path, text);
}

Result<std::vector<std::string>, Faults> read_masks(const std::filesystem::path& path, Rig& rig, const MaskKind& kind) {
  const auto tables = tables_in(path, kind);
  if (!tables) return tables.error();
  std::vector<std::string> notes;
  for (const CameraMasks& table : *tables) {
    const auto camera = std::ranges::find(rig, table.camera, &CameraModel::name);
    if (camera == rig.end()) continue;  // a camera that the configuration has no more
    if (table.width_px != camera->width_px || table.height_px != camera->height_px) {
      notes.push_back(fmt::format(
          "camera {}: the {} masks of {} are for images of {}x{}, not {}x{}; they are left out, {}", table.camera,
          kind.word, path.string(), table.width_px, table.height_px, camera->width_px, camera->height_px, kind.remedy));
      continue;
    }
    (*camera).*kind.of = table.polygons;
    notes.push_back(fmt::format("camera {}: {} masks of {}, polygons={}", table.camera, kind.word, path.string(),
                                table.polygons.size()));
  }
  return notes;
}

}  // namespace mocap::settings
