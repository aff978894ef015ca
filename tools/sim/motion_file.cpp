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
#include "settings/marker_set_file.h"

namespace mocap::sim {
namespace {

Result<std::string> read_whole(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    return Error{ErrorCode::NotFound, fmt::format("motion: cannot read '{}'; is the path right?", file.string())};
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

// As called from the project's folder, or as it lies beside the build.
std::filesystem::path default_marker_set() {
  const std::filesystem::path file = "config/markersets/openmocap18.toml";
  std::error_code error;
  if (std::filesystem::exists(file, error)) return file;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path() / "../../.." / file;
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
    auto loaded = settings::load_marker_set(options.marker_set.empty() ? default_marker_set() : options.marker_set);
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
