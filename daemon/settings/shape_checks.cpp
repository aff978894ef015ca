#include "settings/shape_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>

#include "identify/asymmetry.h"
#include "identify/front_back_ambiguity.h"
#include "identify/shape_ambiguity.h"

namespace mocap::settings {
namespace {

// A marker is found up to the tolerance from its place, and so may one that it is mistaken for: one marker of a shape
// must be further off than both.
double least_difference_m(const DaemonSettings& settings) { return 2.0 * settings.label.rigid_tolerance_m; }

// Two people differ by more than this somewhere.
constexpr double kSameBody_m = 0.005;

constexpr const char* kCure = "move one marker of one of them by 20 mm or more and measure it anew";

void check_itself(TomlTable& table, const Subject& subject, double least_m) {
  const auto mistaken = identify::find_shape_ambiguity(subject.marker_set, subject.marker_set, least_m);
  if (!mistaken) return;
  const auto& markers = subject.marker_set.markers;
  std::size_t m = 0;
  while ((*mistaken)[m] == m) ++m;
  table.fault("marker_set",
              fmt::format("subject '{}' looks the same after a turn that puts marker '{}' at '{}' ({:.0f} mm alike), "
                          "expected a lopsided shape; {}",
                          subject.name, markers[m].name, markers[(*mistaken)[m]].name, 1e3 * least_m, kCure));
}

void check_pair(TomlTable& table, const Subject& one, const Subject& other, double least_m) {
  const bool part = identify::find_shape_ambiguity(one.marker_set, other.marker_set, least_m).has_value();
  const bool whole = identify::find_shape_ambiguity(other.marker_set, one.marker_set, least_m).has_value();
  if (part || whole) {
    table.fault("marker_set",
                fmt::format("subject '{}' has the shape of subject '{}' to {:.0f} mm (or is a part of it, "
                            "or it of this), expected shapes that differ; {}",
                            other.name, one.name, 1e3 * least_m, kCure));
  }
  const bool both = one.fitted && other.fitted;
  if (both && identify::is_same_body(one.marker_set, other.marker_set, kSameBody_m)) {
    table.fault("marker_set", fmt::format("subject '{}' is fitted to the same body as subject '{}' ({:.0f} mm alike), "
                                          "expected a fit of its own; fit it anew to the one who wears it",
                                          other.name, one.name, 1e3 * kSameBody_m));
  }
}

// How far a bone reaches: to the furthest joint that hangs on it.
double length_m(const Skeleton& skeleton, int bone) {
  double longest_m = 0.0;
  for (const Bone& other : skeleton.bones) {
    if (other.parent == bone) longest_m = std::max(longest_m, other.rest_offset_m.norm());
  }
  return longest_m;
}

// As a marker set file has them.
std::string text_of(const MarkerSet& set, std::span<const MarkerPair> pairs) {
  std::string text;
  for (const auto& [one, other] : pairs) {
    text += fmt::format("{}[\"{}\", \"{}\"]", text.empty() ? "" : ", ", set.markers[one].name, set.markers[other].name);
  }
  return fmt::format("asymmetric = [{}]", text);
}

// What keeps a set from being read back to front: to name the pairs that are no mirror images, else to make some; on
// long bones, where there is room.
std::string cure_of(const MarkerSet& set, const identify::FindSettings& find) {
  MarkerSet told = set;
  told.asymmetric = identify::asymmetric_markers(set);
  if (!identify::has_front_back_ambiguity(told, find)) {
    return "name the pairs that are no mirror images of each other seen from the front: " +
           text_of(set, told.asymmetric);
  }
  std::vector<MarkerPair> pairs = identify::opposite_markers(set);
  std::erase_if(pairs, [&](const MarkerPair& pair) { return std::ranges::count(told.asymmetric, pair) > 0; });
  std::ranges::stable_sort(pairs, std::ranges::greater{},
                           [&](const MarkerPair& pair) { return length_m(set.skeleton, set.markers[pair.one].bone); });
  pairs.resize(std::min<std::size_t>(3, pairs.size()));
  return "move one marker of each of these pairs 50 mm along its bone, measure it anew, and name the pairs: " +
         text_of(set, pairs);
}

}  // namespace

std::vector<std::string> shape_doubts(const DaemonSettings& settings) {
  const identify::FindSettings find{.min_marker_fraction = settings.label.least_share,
                                    .max_rms_m = settings.label.most_rms_m};
  std::vector<std::string> doubts;
  for (std::size_t i = 0; i < settings.worn.size(); ++i) {
    const auto& [name, set, fitted] = settings.worn[i];
    const bool measured_in_tpose = !fitted && set.skeleton.bones.size() > 1;
    if (!measured_in_tpose || !identify::has_front_back_ambiguity(set, find)) continue;
    doubts.push_back(
        fmt::format("subject '{}' is read back to front in T-pose if markers of arms and legs sit on the other face "
                    "than marker set '{}' says; {}, in {}",
                    name, set.name, cure_of(set, find), settings.subjects[i].marker_set_file.string()));
  }
  return doubts;
}

void check_shapes(DaemonTables& tables, const DaemonSettings& settings) {
  const double least_m = least_difference_m(settings);
  for (std::size_t i = 0; i < settings.worn.size(); ++i) {
    check_itself(tables.subjects[i], settings.worn[i], least_m);
    for (std::size_t j = 0; j < i; ++j) check_pair(tables.subjects[i], settings.worn[j], settings.worn[i], least_m);
  }
}

}  // namespace mocap::settings
