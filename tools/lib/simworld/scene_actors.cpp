#include "lib/simworld/scene_actors.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

#include "bodyfit/fit_subject.h"
#include "scene/bvh.h"
#include "scene/c3d.h"
#include "scene/clip_actor.h"
#include "scene/import_marker_set.h"
#include "scene/placed_actor.h"
#include "scene/procedural_actor.h"
#include "scene/random.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::simworld {
namespace {

namespace fs = std::filesystem;

Error in_file(const fs::path& file, const Error& error) {
  return {error.code, fmt::format("motion '{}': {}", file.string(), error.message)};
}

Result<std::string> read_whole(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return Error{ErrorCode::NotFound, fmt::format("motion '{}' cannot be read", file.string())};
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

Result<scene::C3d> read_c3d(const fs::path& file) {
  const auto bytes = read_whole(file);
  if (!bytes) return bytes.error();
  auto c3d = scene::parse_c3d(std::as_bytes(std::span(*bytes)));
  if (!c3d) return in_file(file, c3d.error());
  return c3d;
}

Result<std::unique_ptr<scene::Actor>> c3d_actor(const fs::path& file) {
  auto c3d = read_c3d(file);
  if (!c3d) return c3d.error();
  return scene::make_c3d_actor(std::move(*c3d));
}

// The marker set fitted to a static trial: the labels of the C3D file select the markers, the positions determine bone
// lengths and marker offsets.
Result<MarkerSet> fitted(const fs::path& file, const MarkerSet& given) {
  const auto c3d = read_c3d(file);
  if (!c3d) return c3d.error();
  auto imported = scene::import_marker_set(*c3d, given.skeleton, given.name);
  if (!imported) return in_file(file, imported.error());
  const MarkerSet& set = imported->marker_set;
  auto fit = bodyfit::fit_subject(set, scene::take_of(*c3d, set), {}, {});
  if (!fit) return Error{ErrorCode::InvalidArgument, fmt::format("fit '{}': it shows no markers", file.string())};
  return std::move(fit->marker_set);
}

std::vector<std::uint32_t> markers_by_name(const MarkerSet& of, const MarkerSet& in) {
  std::vector<std::uint32_t> indices;
  for (const MarkerOnBone& marker : of.markers) {
    const auto same = [&](const MarkerOnBone& other) { return other.name == scene::without_subject(marker.name); };
    const auto found = std::ranges::find_if(in.markers, same);
    indices.push_back(found == in.markers.end() ? Performer::kNobodys
                                                : static_cast<std::uint32_t>(found - in.markers.begin()));
  }
  return indices;
}

Result<Performer> make_performer(const SceneFile& scene, const SceneActor& wanted, const std::string& clip,
                                 scene::Random random) {
  const std::string& motion = wanted.motion.empty() ? clip : wanted.motion;
  const std::string extension = fs::path(motion).extension().string();
  Result<MarkerSet> given = settings::load_marker_set(wanted.marker_set);
  if (!given) return given.error();
  const MarkerSet body = true_body(*given, wanted.size, wanted.marker_error_mm, random);

  std::string found = motion;
  if (extension == ".bvh" || extension == ".c3d") {
    const auto file = find_motion(scene, motion);
    if (!file) return file.error();
    found = file->string();
  }
  auto made = extension == ".c3d" ? c3d_actor(found) : make_body_actor(found, body, wanted);
  if (!made) return made.error();
  std::unique_ptr<scene::Actor> actor = std::move(*made);
  Performer performer;
  performer.subject = {wanted.name, wanted.stored ? body : std::move(*given), wanted.stored};
  if (!wanted.fit.empty()) {
    const auto file = find_motion(scene, wanted.fit);
    if (!file) return file.error();
    auto set = fitted(*file, performer.subject.marker_set);
    if (!set) return set.error();
    performer.subject.marker_set = std::move(*set);
    performer.subject.fitted = true;
  }
  performer.marker_of = markers_by_name(actor->marker_set(), performer.subject.marker_set);
  performer.actor =
      scene::make_placed_actor(std::move(actor), {.at_m = {wanted.place_m[0], wanted.place_m[1]},
                                                  .heading_rad = wanted.heading_deg * std::numbers::pi / 180.0,
                                                  .delay_s = wanted.delay_s});
  return performer;
}

}  // namespace

MarkerSet true_body(MarkerSet set, double size, double marker_error_mm, scene::Random random) {
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= size;
  for (MarkerOnBone& marker : set.markers) {
    marker.offset_m *= size;
    for (Eigen::Index axis = 0; axis < 3; ++axis) marker.offset_m[axis] += 1e-3 * marker_error_mm * random.normal();
  }
  return set;
}

Result<std::unique_ptr<scene::Actor>> make_body_actor(const std::string& motion, const MarkerSet& body,
                                                      const SceneActor& wanted) {
  if (!motion.ends_with(".bvh")) {
    auto program = scene::parse_program(motion);
    if (!program) return program.error();
    return scene::make_procedural_actor(body, std::move(*program));
  }
  const auto text = read_whole(motion);
  if (!text) return text.error();
  auto bvh = scene::parse_bvh(*text);
  if (!bvh) return in_file(motion, bvh.error());
  auto actor = scene::make_bvh_actor(std::move(*bvh), body,
                                     {.unit_m = 0.0,
                                      .t_pose_s = wanted.t_pose_s,
                                      .arms_lowered_rad = wanted.arms_lowered_deg * std::numbers::pi / 180.0});
  if (!actor) return in_file(motion, actor.error());
  return actor;
}

Result<std::vector<Performer>> make_performers(const SceneFile& scene, const std::string& clip, std::uint64_t seed) {
  std::vector<Performer> performers;
  for (const SceneActor& wanted : scene.actors) {
    auto performer = make_performer(scene, wanted, clip, scene::Random(scene::mixed(seed) + performers.size()));
    if (!performer) return performer.error();
    performers.push_back(std::move(*performer));
  }
  return performers;
}

}  // namespace mocap::simworld
