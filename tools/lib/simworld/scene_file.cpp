#include "lib/simworld/scene_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <numbers>

#include "model/bounds.h"
#include "settings/sections.h"
#include "settings/toml/toml_file.h"

namespace mocap::simworld {
namespace {

namespace fs = std::filesystem;
using settings::TomlTable;

// Sections of mocapd.toml with settings of the pipeline steps.
constexpr const char* kPipelineSections[] = {"align", "match", "triangulate", "track_markers",
                                             "label", "solve", "refine"};

void read_rig(TomlTable& table, SceneFile& scene) {
  table.number("cameras", scene.ring.cameras, {2, 64});
  table.number("radius_m", scene.ring.radius_m, {0.5, 100});
  table.number("height_m", scene.ring.height_m, {0.1, 50});
  table.number("width_px", scene.ring.width_px, {64, 16384});
  table.number("height_px", scene.ring.height_px, {64, 16384});
  table.degrees("hfov_deg", scene.ring.hfov_rad, {1, 170});
  table.path("file", scene.rig_file);
}

void read_image(TomlTable& table, SceneFile& scene) {
  table.number("marker_diameter_mm", scene.marker_diameter_mm, {1, 100});
  table.number("noise", scene.noise, {0, 100});
  table.number("false_blobs", scene.false_blobs, {0, 10});
  table.flag("occlusion", scene.occlusion);
  table.flag("drawn", scene.drawn);
}

SceneActor read_actor(TomlTable& table) {
  SceneActor actor;
  table.text("name", actor.name);
  if (!actor.name.empty()) table.call(fmt::format("actor '{}'", actor.name));
  table.require("name", "the subject's name");
  table.text("motion", actor.motion);
  table.path("marker_set", actor.marker_set);
  if (!actor.marker_set.empty()) actor.marker_set = table.shipped_file("marker_set").path;
  table.require("marker_set", "a file of config/markersets");
  table.number("t_pose_s", actor.t_pose_s, {0, 1000});
  table.number("arms_lowered_deg", actor.arms_lowered_deg, {0, 90});
  table.numbers("place_m", actor.place_m, {-100, 100});
  table.number("heading_deg", actor.heading_deg, {-360, 360});
  table.number("delay_s", actor.delay_s, {0, 1000});
  table.number("size", actor.size, {0.2, 5});
  table.number("marker_error_mm", actor.marker_error_mm, {0, 200});
  table.flag("stored", actor.stored);
  table.text("fit", actor.fit);
  table.done();
  return actor;
}

SceneBlackout read_blackout(TomlTable& table) {
  SceneBlackout blackout;
  table.number("first_s", blackout.first_s, {0, 1e6});
  table.number("for_s", blackout.for_s, {0.01, 1000});
  table.number("times", blackout.times, {1, 10000});
  table.number("gap_min_s", blackout.gap_min_s, {0, 1000});
  table.number("gap_max_s", blackout.gap_max_s, {0, 1000});
  if (blackout.gap_max_s < blackout.gap_min_s) table.fault("gap_max_s", "gap_max_s is less than gap_min_s");
  table.done();
  return blackout;
}

SceneImageLoss read_image_loss(TomlTable& table) {
  SceneImageLoss loss;
  table.number("first_s", loss.first_s, {0, 1e6});
  table.number("for_min_s", loss.for_min_s, {0.01, 1000});
  table.number("for_max_s", loss.for_max_s, {0.01, 1000});
  table.number("return_s", loss.return_s, {0, 1000});
  table.number("times", loss.times, {1, 10000});
  table.number("gap_s", loss.gap_s, {0, 1000});
  if (loss.for_max_s < loss.for_min_s) table.fault("for_max_s", "for_max_s is less than for_min_s");
  table.done();
  return loss;
}

SceneHide read_hide(TomlTable& table) {
  SceneHide hide;
  table.number("from_s", hide.from_s, {0, 1e6});
  table.number("to_s", hide.to_s, {0, 1e9});
  table.number("share", hide.share, {0, 0.95});
  table.number("for_s", hide.for_s, {0.01, 1000});
  table.number("for_p90_s", hide.for_p90_s, {0, 1000});
  table.text("markers", hide.markers);
  table.done();
  return hide;
}

SceneOnlyCamera read_only_camera(TomlTable& table) {
  SceneOnlyCamera only;
  table.text("actor", only.actor);
  table.text("markers", only.markers);
  table.require("markers", "names of the markers that only one camera sees");
  table.text("hidden", only.hidden);
  table.text("bone", only.bone);
  table.number("camera", only.camera, {1, 64});
  table.number("from_s", only.from_s, {0, 1e6});
  table.number("for_s", only.for_s, {0.01, 1000});
  table.number("times", only.times, {1, 10000});
  table.number("gap_s", only.gap_s, {0, 1000});
  table.done();
  return only;
}

void read_goal(TomlTable& table, SceneGoal& goal) {
  table.number("f1", goal.f1, {0, 1});
  table.number("availability", goal.availability, {0, 1});
  table.number("longest_wrong_sets", goal.longest_wrong_sets, {0, 1e6});
  table.number("joint_rms_mm", goal.joint_rms_mm, {0, 1e6});
  table.number("rotation_rms_deg", goal.rotation_rms_deg, {0, 180});
  table.number("reacquired_share", goal.reacquired_share, {0, 1});
  table.number("hidden_joint_rms_mm", goal.hidden_joint_rms_mm, {0, 1e6});
  table.number("exchanges", goal.exchanges, {0, 1e9});
  table.number("ray_gain", goal.ray_gain, {0, 1e6});
}

void read_lists(TomlTable& root, SceneFile& scene) {
  for (TomlTable& table : root.tables("clip", "clip")) {
    std::string motion;
    table.text("motion", motion);
    table.require("motion", "a BVH or C3D file");
    table.done();
    scene.clips.push_back(motion);
  }
  for (TomlTable& table : root.tables("actor", "actor")) scene.actors.push_back(read_actor(table));
  for (TomlTable& table : root.tables("blackout", "blackout")) scene.blackouts.push_back(read_blackout(table));
  for (TomlTable& table : root.tables("image_loss", "image_loss")) {
    scene.image_losses.push_back(read_image_loss(table));
  }
  for (TomlTable& table : root.tables("hide", "hide")) scene.hides.push_back(read_hide(table));
  for (TomlTable& table : root.tables("only_camera", "only_camera")) {
    scene.only_camera.push_back(read_only_camera(table));
    SceneOnlyCamera& only = scene.only_camera.back();
    if (only.actor.empty() && !scene.actors.empty()) only.actor = scene.actors.front().name;
    const bool known = std::ranges::any_of(scene.actors, [&](const SceneActor& a) { return a.name == only.actor; });
    if (!known) table.fault("actor", fmt::format("there is no actor '{}'", only.actor));
  }
}

void check_together(TomlTable& root, const SceneFile& scene) {
  if (scene.actors.empty()) root.fault("there is no [[actor]]");
  if (scene.actors.size() > kMaxSubjects) root.fault(fmt::format("more than {} actors", kMaxSubjects));
  for (const SceneActor& actor : scene.actors) {
    if (actor.motion.empty() && scene.clips.empty()) {
      root.fault(fmt::format("actor '{}' has no motion, and there is no [[clip]]", actor.name));
    }
    const auto same = [&](const SceneActor& other) { return other.name == actor.name; };
    if (std::ranges::count_if(scene.actors, same) > 1) root.fault(fmt::format("actor '{}' is there twice", actor.name));
  }
}

}  // namespace

Result<SceneFile, settings::Faults> load_scene(const fs::path& path) {
  Result<settings::TomlFile, settings::Faults> file = settings::TomlFile::open(path);
  if (!file) return file.error();
  SceneFile scene;
  scene.path = path;
  scene.ring = {.cameras = 8, .radius_m = 4.0, .height_m = 2.5, .width_px = 1280, .height_px = 1024};
  TomlTable root = file->root();
  root.text("about", scene.about);
  root.number("seconds", scene.seconds, {0.1, 36000});
  root.number("rate_hz", scene.rate_hz, {1, 2000});
  root.number("seed", scene.seed, {0, 1e15});
  if (auto score = root.table("score", "score")) score->text("below", scene.score.below), score->done();
  if (auto rig = root.table("rig", "rig")) read_rig(*rig, scene), rig->done();
  if (auto image = root.table("image", "image")) read_image(*image, scene), image->done();
  if (auto goal = root.table("goal", "goal")) read_goal(*goal, scene.goal), goal->done();
  for (const settings::Section& section : settings::sections()) {
    const bool of_the_pipeline = std::ranges::any_of(
        kPipelineSections, [&](const char* name) { return std::string_view(name) == section.name; });
    if (!of_the_pipeline) continue;
    if (auto table = root.table(section.name, section.name)) {
      section.declare(*table, scene.daemon);
      table->done();
    }
  }
  read_lists(root, scene);
  check_together(root, scene);
  root.done();
  if (!file->faults().list.empty()) return file->faults();
  return scene;
}

Result<fs::path> find_motion(const SceneFile& scene, const std::string& motion) {
  std::error_code error;
  std::vector<fs::path> places{fs::absolute(scene.path, error).parent_path()};
  if (const char* data = std::getenv("MOCAP_SHARED_DATA"); data != nullptr) places.emplace_back(data);
  for (fs::path above = places.front(); above.has_relative_path(); above = above.parent_path()) {
    places.push_back(above.parent_path() / "shared" / "data");
  }
  for (const fs::path& place : places) {
    if (fs::exists(place / motion, error)) return place / motion;
  }
  return Error{ErrorCode::NotFound,
               fmt::format("motion '{}' is neither beside '{}' nor in the folder that MOCAP_SHARED_DATA names nor in "
                           "shared/data above it",
                           motion, scene.path.string())};
}

}  // namespace mocap::simworld
