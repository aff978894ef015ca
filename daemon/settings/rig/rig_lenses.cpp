#include "settings/rig/rig_lenses.h"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <array>
#include <string>
#include <tuple>
#include <vector>

#include "base/replace_file.h"
#include "settings/rig/rig_file.h"
#include "settings/rig/rig_text.h"
#include "settings/toml/text_edit.h"
#include "settings/toml/text_file.h"

namespace mocap::settings {
namespace {

constexpr std::array<const char*, 3> kKeys{"matrix", "distortions", "fisheye"};

std::string value_text(const Lens& lens, const std::string& key) {
  const auto& d = lens.distortion;
  const bool fisheye = lens.kind == LensKind::Fisheye;
  if (key == "fisheye") return fisheye ? "true" : "false";
  if (key == "distortions") {
    return fisheye ? list_text({d[0], d[1], d[2], d[3]}) : list_text({d[0], d[1], d[2], d[3], d[4]});
  }
  return fmt::format("[{}, {}, {}]", list_text({lens.fx_px, 0.0, lens.cx_px}), list_text({0.0, lens.fy_px, lens.cy_px}),
                     list_text({0.0, 0.0, 1.0}));
}

// The edits of one camera's table.
void edit_lens(const toml::table& table, const Lens& lens, const std::string& text, const LineIndex& lines,
               std::vector<TextEdit>& edits) {
  toml::source_position last = table.source().begin;  // the header
  for (const auto& [key, node] : table) {
    const auto end = node.source().end;
    if (std::tie(last.line, last.column) < std::tie(end.line, end.column)) last = end;
  }
  std::string added;
  for (const char* key : kKeys) {
    const toml::node* node = table.get(key);
    if (node == nullptr) {
      added += fmt::format("{} = {}\n", key, value_text(lens, key));
      continue;
    }
    edits.push_back(
        {offset_in(lines, node->source().begin), offset_in(lines, node->source().end), value_text(lens, key)});
  }
  if (const toml::node* node = table.get(kLensFromFov))
    edits.push_back({offset_in(lines, node->source().begin), offset_in(lines, node->source().end), "false"});
  if (added.empty()) return;
  const std::size_t at = lines.next_line(offset_in(lines, last));
  const bool open_end = at == text.size() && !text.empty() && text.back() != '\n';
  edits.push_back({at, at, (open_end ? "\n" : "") + added});
}

bool has_other_size(const toml::table& table, const CameraModel& camera) {
  const auto width = table["size"][0].value<double>();
  const auto height = table["size"][1].value<double>();
  return width && height && (*width != camera.width_px || *height != camera.height_px);
}

// The table of a camera of which only the lens is known.
std::string new_table(const CameraModel& camera) {
  std::string text = fmt::format("\n[{0}]\nname = {0}\nsize = [{1}, {2}]\n", quoted_text(camera.name), camera.width_px,
                                 camera.height_px);
  for (const char* key : kKeys) text += fmt::format("{} = {}\n", key, value_text(camera.lens, key));
  return text + "rotation = [0.0, 0.0, 0.0]  # unknown: see mocap-calibrate wand\ntranslation = [0.0, 0.0, 0.0]\n";
}

// The file without lenses and without the tables that the edit adds: the part that the edit must not change.
toml::table without_lenses(toml::table root, const std::vector<std::string>& added) {
  for (const std::string& name : added) root.erase(name);
  for (auto&& [key, node] : root) {
    toml::table* table = node.as_table();
    for (const char* each : kKeys) {
      if (table != nullptr) table->erase(each);
    }
    if (table != nullptr) table->erase(kLensFromFov);
  }
  return root;
}

Error refuse(const std::filesystem::path& path, const std::string& what) {
  return {ErrorCode::InvalidArgument, fmt::format("{}: {}", path.string(), what)};
}

Result<std::string> edited_rig(const std::filesystem::path& path, const std::string& text, const Rig& cameras) {
  const toml::table root = toml::parse(text, path.string());
  const LineIndex lines(text);
  std::vector<TextEdit> edits;
  std::vector<std::string> known;
  for (const auto& [key, node] : root) {
    const toml::table* table = node.as_table();
    if (table == nullptr || key.str() == kRigMetadata) continue;
    const auto name = (*table)["name"].value_or(std::string(key.str()));
    const auto camera = std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == name; });
    if (camera == cameras.end()) continue;
    known.push_back(name);
    if (table->is_inline())
      return refuse(path, fmt::format("camera '{0}' stands in braces, expected a table [{0}]", name));
    if (has_other_size(*table, *camera)) {
      return refuse(
          path, fmt::format("camera '{}' is {}x{} there, its images are {}x{}", name, (*table)["size"][0].value_or(0.0),
                            (*table)["size"][1].value_or(0.0), camera->width_px, camera->height_px));
    }
    edit_lens(*table, camera->lens, text, lines, edits);
  }
  std::string result = edited(text, std::move(edits));
  std::vector<std::string> added;
  for (const CameraModel& camera : cameras) {
    if (std::find(known.begin(), known.end(), camera.name) != known.end()) continue;
    if (root.contains(camera.name)) return refuse(path, fmt::format("table [{}] is another camera's", camera.name));
    if (!result.empty() && result.back() != '\n') result += '\n';
    result += new_table(camera);
    added.push_back(camera.name);
  }
  if (without_lenses(toml::parse(result, path.string()), added) != without_lenses(root, {})) {
    return refuse(path,
                  "cannot be edited without harm to the rest; write it with a table [name] a camera and a line a key");
  }
  return result;
}

}  // namespace

Status save_lenses(const std::filesystem::path& path, const Rig& cameras) {
  if (std::ranges::find(cameras, kRigMetadata, &CameraModel::name) != cameras.end()) {
    return refuse(path, fmt::format("not written: a camera is named '{}', the name of the table with facts about the "
                                    "rig; rename the camera",
                                    kRigMetadata));
  }
  std::error_code failed;
  if (!std::filesystem::exists(path, failed)) {
    std::string text = "# Lenses only: mocap-calibrate wand finds the poses of the cameras.\n";
    for (const CameraModel& camera : cameras) text += new_table(camera);
    return replace_file(path, text);
  }
  const Result<std::string, Fault> read = read_text(path);
  if (!read) return Error{ErrorCode::Io, to_text(read.error())};
  const std::string& text = *read;
  try {
    const auto result = edited_rig(path, text, cameras);
    if (!result) return result.error();
    return replace_file(path, *result);
  } catch (const toml::parse_error& error) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{}:{}:{}: {}", path.string(), error.source().begin.line,
                                                         error.source().begin.column, error.description())};
  }
}

}  // namespace mocap::settings
