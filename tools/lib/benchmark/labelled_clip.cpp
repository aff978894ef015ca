#include "lib/benchmark/labelled_clip.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <set>
#include <span>
#include <utility>

#include "lib/functional/motion_import.h"
#include "lib/simworld/trc_file.h"
#include "scene/c3d.h"
#include "scene/import_marker_set.h"
#include "settings/shipped_files.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::benchmark {
namespace {

namespace fs = std::filesystem;

// Height of the lowest marker of a person who stands on the floor, m: about that of a marker on a shoe.
constexpr double kLowestMarker_m = 0.03;

Error in_file(const fs::path& file, const Error& error) {
  return {error.code, fmt::format("take '{}': {}", file.string(), error.message)};
}

Result<scene::C3d> read_points(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return Error{ErrorCode::NotFound, fmt::format("take '{}' cannot be read", file.string())};
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  const std::string extension = file.extension().string();
  if (extension != ".c3d" && extension != ".trc") {
    return in_file(file, {ErrorCode::InvalidArgument, "its name ends neither in .c3d nor in .trc"});
  }
  auto points = extension == ".trc" ? simworld::parse_trc(bytes) : scene::parse_c3d(std::as_bytes(std::span(bytes)));
  if (!points) return in_file(file, points.error());
  return points;
}

// Gives each point a label of its own: a second point with a label is no marker of the set.
void make_labels_unique(std::vector<std::string>& labels) {
  std::set<std::string, std::less<>> taken;
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i].empty()) labels[i].push_back('*');
    if (!taken.insert(labels[i]).second) labels[i] = fmt::format("{}#{}", labels[i], i);
    taken.insert(labels[i]);
  }
}

Result<MarkerSet> marker_set_of(const scene::C3d& points, const std::optional<fs::path>& file) {
  if (file) return settings::load_marker_set(*file);
  if (functional::has_own_labels(points)) {
    auto found = functional::import_by_motion(points, "benchmark");
    if (!found) return found.error();
    return std::move(found->imported.marker_set);
  }
  const settings::FoundFile found = settings::find_shipped("skeletons/human18.toml", {});
  if (!found.missing.empty()) return Error{ErrorCode::NotFound, "skeleton: " + found.missing};
  auto skeleton = settings::load_skeleton(found.path);
  if (!skeleton) return skeleton.error();
  auto imported = scene::import_marker_set(points, *skeleton, "benchmark");
  if (!imported) return imported.error();
  return std::move(imported->marker_set);
}

}  // namespace

Result<LabelledClip> load_labelled_clip(const fs::path& file, const std::optional<fs::path>& marker_set_file) {
  auto points = read_points(file);
  if (!points) return points.error();
  make_labels_unique(points->labels);
  auto set = marker_set_of(*points, marker_set_file);
  if (!set) return in_file(file, set.error());

  // One take of all points turns them upright together.
  MarkerSet everything = *set;
  const auto kinds = scene::kinds_of(points->labels);
  LabelledClip clip;
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const std::string label(scene::without_subject(points->labels[i]));
    if (kinds[i] == scene::C3dPointKind::ModelOutput) continue;
    if (std::ranges::find(set->markers, label, &MarkerOnBone::name) != set->markers.end()) continue;
    clip.other.push_back(label);
    everything.markers.push_back({label, 0, Eigen::Vector3d::Zero(), {}});
  }
  const bodyfit::LabelledTake all = scene::take_of(*points, everything);
  const std::size_t markers = set->markers.size();
  clip.name = file.stem().string();
  clip.rate_hz = points->rate_hz;
  clip.take.markers = markers;
  for (std::size_t frame = 0; frame < all.frames(); ++frame) {
    const auto places = all.frame(frame);
    clip.take.places_m.insert(clip.take.places_m.end(), places.begin(),
                              places.begin() + static_cast<std::ptrdiff_t>(markers));
    clip.others_m.insert(clip.others_m.end(), places.begin() + static_cast<std::ptrdiff_t>(markers), places.end());
  }
  clip.marker_set = *std::move(set);
  if (clip.frames() == 0 || !(clip.rate_hz > 0.0)) {
    return in_file(file, {ErrorCode::InvalidArgument, "it has no frames, expected at least one and a rate"});
  }
  return clip;
}

std::optional<MarkerSet> fit_body(const LabelledClip& clip, const bodyfit::LabelledTake& take, bool at_rest) {
  const bodyfit::LabelledTake none{clip.marker_set.markers.size(), {}};
  auto fit = bodyfit::fit_subject(clip.marker_set, at_rest ? take : none, at_rest ? none : take, {});
  if (!fit) return std::nullopt;
  return std::move(fit->marker_set);
}

std::vector<Eigen::Vector3d> rest_positions_m(const MarkerSet& set) {
  std::vector<Eigen::Vector3d> joints_m;  // by bone; a parent stands before its children
  for (const Bone& bone : set.skeleton.bones) {
    const Eigen::Vector3d parent_m =
        bone.parent < 0 ? Eigen::Vector3d::Zero() : joints_m[static_cast<std::size_t>(bone.parent)];
    joints_m.push_back(parent_m + bone.rest_offset_m);
  }
  std::vector<Eigen::Vector3d> places_m;
  double lowest_m = std::numeric_limits<double>::max();
  for (const MarkerOnBone& marker : set.markers) {
    places_m.push_back(joints_m[static_cast<std::size_t>(marker.bone)] + marker.offset_m);
    lowest_m = std::min(lowest_m, places_m.back().z());
  }
  for (Eigen::Vector3d& place_m : places_m) place_m.z() += kLowestMarker_m - lowest_m;
  return places_m;
}

}  // namespace mocap::benchmark
