#include "motion_file.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "scene/bvh.h"
#include "scene/c3d.h"
#include "scene/clip_actor.h"
#include "scene/procedural_actor.h"
#include "scene/prop_actor.h"
#include "settings/shipped_files.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::sim {
namespace {

Result<std::string> read_whole(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    return Error{ErrorCode::NotFound, fmt::format("motion: cannot read '{}'; is the path right?", file.string())};
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

// The file of --marker-set, or the set of the default.
Result<std::filesystem::path> marker_set_file(const std::filesystem::path& wanted) {
  const settings::FoundFile found = settings::find_shipped(wanted.empty() ? "markersets/openmocap18.toml" : wanted, {});
  if (found.missing.empty()) return found.path;
  return Error{ErrorCode::NotFound, "marker set: " + found.missing};
}

Error in_file(const std::string& file, const Error& error) {
  return {error.code, fmt::format("motion '{}': {}", file, error.message)};
}

}  // namespace

Result<std::unique_ptr<scene::Actor>> make_actor(const Options& options) {
  const std::string extension = std::filesystem::path(options.motion).extension().string();
  if (extension == ".c3d") {
    const auto bytes = read_whole(options.motion);
    if (!bytes) return bytes.error();
    auto c3d = scene::parse_c3d(std::as_bytes(std::span(*bytes)));
    if (!c3d) return in_file(options.motion, c3d.error());
    return scene::make_c3d_actor(std::move(*c3d));
  }
  if (scene::is_prop(options.motion)) return scene::make_prop_actor(options.motion);
  std::optional<MarkerSet> marker_set;
  if (extension != ".bvh" || !options.marker_set.empty()) {
    const auto file = marker_set_file(options.marker_set);
    if (!file) return file.error();
    auto loaded = settings::load_marker_set(*file);
    if (!loaded) return loaded.error();
    marker_set = std::move(*loaded);
  }
  if (extension == ".bvh") {
    const auto text = read_whole(options.motion);
    if (!text) return text.error();
    auto bvh = scene::parse_bvh(*text);
    if (!bvh) return in_file(options.motion, bvh.error());
    return scene::make_bvh_actor(std::move(*bvh), std::move(marker_set),
                                 {.unit_m = options.bvh_unit_m, .t_pose_s = options.t_pose_s});
  }
  auto program = scene::parse_program(options.motion);
  if (!program) return program.error();
  return scene::make_procedural_actor(std::move(*marker_set), std::move(*program));
}

}  // namespace mocap::sim
