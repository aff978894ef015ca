#include "settings/rig/rig_masks.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/replace_file.h"
#include "settings/rig/rig_text.h"
#include "settings/toml/text_edit.h"
#include "settings/toml/text_file.h"

namespace mocap::settings {
namespace {

const CameraModel* find(const Rig& rig, const std::string& name) {
  const auto found = std::find_if(rig.begin(), rig.end(), [&](const CameraModel& each) { return each.name == name; });
  return found == rig.end() ? nullptr : &*found;
}

TextEdit edit_of(const toml::table& table, std::span<const MaskPolygon> masks, const char* masks_key,
                 const std::string& text, const LineIndex& lines) {
  const std::string line = masks.empty() ? "" : fmt::format("{} = {}", masks_key, mask_text(masks));
  toml::source_position last = table.source().begin;  // the header
  for (const auto& [key, node] : table) {
    const auto end = node.source().end;
    if (key.str() == masks_key) {
      const std::size_t begin = offset_in(lines, key.source().begin);
      const std::size_t behind = offset_in(lines, end);
      return {begin, masks.empty() ? lines.next_line(behind) : behind, line};
    }
    if (std::tie(last.line, last.column) < std::tie(end.line, end.column)) last = end;
  }
  const std::size_t at = lines.next_line(offset_in(lines, last));
  if (masks.empty()) return {at, at, ""};
  const bool open_end = at == text.size() && !text.empty() && text.back() != '\n';
  return {at, at, (open_end ? "\n" : "") + line + "\n"};
}

// The file without these masks: the part that the edit must not change.
toml::table rest_of(toml::table root, const char* masks_key) {
  for (auto&& [key, node] : root) {
    if (toml::table* table = node.as_table()) table->erase(masks_key);
  }
  return root;
}

}  // namespace

Result<std::vector<std::string>> save_masks(const std::filesystem::path& path, const Rig& rig, const MaskKind& kind) {
  const Result<std::string, Fault> read = read_text(path);
  if (!read) return Error{ErrorCode::Io, to_text(read.error())};
  const std::string& text = *read;
  try {
    const toml::table root = toml::parse(text, path.string());
    const LineIndex lines(text);
    std::vector<TextEdit> edits;
    std::vector<const CameraModel*> found;
    for (const auto& [key, node] : root) {
      const toml::table* table = node.as_table();
      if (table == nullptr || key.str() == kRigMetadata) continue;
      const CameraModel* camera = find(rig, (*table)["name"].value_or(std::string(key.str())));
      if (camera == nullptr) continue;
      found.push_back(camera);
      if (table->is_inline()) {
        return Error{ErrorCode::InvalidArgument, fmt::format("{}: camera '{}' stands in braces, expected a table [{}]",
                                                             path.string(), camera->name, camera->name)};
      }
      edits.push_back(edit_of(*table, camera->*kind.of, kind.key, text, lines));
    }
    std::vector<std::string> without_place;
    for (const CameraModel& camera : rig) {
      const bool has_place = std::ranges::find(found, &camera) != found.end();
      if (!has_place && !(camera.*kind.of).empty()) without_place.push_back(camera.name);
    }
    const std::string result = edited(text, std::move(edits));
    if (result == text) return without_place;
    if (rest_of(toml::parse(result, path.string()), kind.key) != rest_of(root, kind.key)) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("{} cannot be edited without harm to the rest; write it with a table [name] a camera and "
                      "a line a key",
                      path.string())};
    }
    if (const Status replaced = replace_file(path, result); !replaced) return replaced.error();
    return without_place;
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{}:{}:{}: {}", path.string(), error.source().begin.line,
                                                         error.source().begin.column, error.description())};
  }
}

std::string no_place_for_masks(const std::filesystem::path& path, std::span<const std::string> cameras) {
  return fmt::format(
      "{} has no camera '{}': these masks have no place and are not saved; calibrate first (mocap-calibrate wand)",
      path.string(), fmt::join(cameras, "', '"));
}

}  // namespace mocap::settings
