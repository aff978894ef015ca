#include "settings/subject/shape_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <span>

#include "identify/asymmetry.h"
#include "identify/front_back_ambiguity.h"
#include "identify/shape_ambiguity.h"

namespace mocap::settings {
namespace {

// A marker may be off its place by the tolerance, and so may the marker it is mistaken for. Two shapes differ if at
// least one marker is further off than both tolerances together.
double least_difference_m(const DaemonSettings& settings) { return 2.0 * settings.label.rigid_tolerance_m; }

// Two people differ by more than this in at least one offset. Chosen by hand; not yet measured.
constexpr double kSameBody_m = 0.005;

constexpr const char* kRemedy = "move one marker of one of them by 20 mm or more and measure it again";

void check_symmetry(TomlTable& table, const Subject& subject, double least_m) {
  const auto mistaken = identify::find_shape_ambiguity(subject.marker_set, subject.marker_set, least_m);
  if (!mistaken) return;
  const auto& markers = subject.marker_set.markers;
  std::size_t m = 0;
  while ((*mistaken)[m] == m) ++m;
  table.fault(
      "marker_set",
      fmt::format("subject '{}' looks the same after a rotation that moves marker '{}' to '{}' (within {:.0f} mm), "
                  "expected an asymmetric shape; {}",
                  subject.name, markers[m].name, markers[(*mistaken)[m]].name, 1e3 * least_m, kRemedy));
}

void check_pair(TomlTable& table, const Subject& one, const Subject& other, double least_m) {
  const bool part = identify::find_shape_ambiguity(one.marker_set, other.marker_set, least_m).has_value();
  const bool whole = identify::find_shape_ambiguity(other.marker_set, one.marker_set, least_m).has_value();
  if (part || whole) {
    table.fault("marker_set",
                fmt::format("subject '{}' has the shape of subject '{}' within {:.0f} mm (or one is a part of "
                            "the other), expected shapes that differ; {}",
                            other.name, one.name, 1e3 * least_m, kRemedy));
  }
  const bool both = one.fitted && other.fitted;
  if (both && identify::is_same_body(one.marker_set, other.marker_set, kSameBody_m)) {
    table.fault("marker_set", fmt::format("subject '{}' is fitted to the same body as subject '{}' (within {:.0f} mm), "
                                          "expected a fit of its own; fit it again to its person",
                                          other.name, one.name, 1e3 * kSameBody_m));
  }
}

// The distance from a bone's joint to the furthest joint of its children.
double length_m(const Skeleton& skeleton, int bone) {
  double longest_m = 0.0;
  for (const Bone& other : skeleton.bones) {
    if (other.parent == bone) longest_m = std::max(longest_m, other.rest_offset_m.norm());
  }
  return longest_m;
}

// The pairs in the format of a marker set file.
std::string text_of(const MarkerSet& set, std::span<const MarkerPair> pairs) {
  std::string text;
  for (const auto& [one, other] : pairs) {
    text += fmt::format("{}[\"{}\", \"{}\"]", text.empty() ? "" : ", ", set.markers[one].name, set.markers[other].name);
  }
  return fmt::format("asymmetric = [{}]", text);
}

// The remedy for a set that does not distinguish front from back: list the pairs that are no mirror images; if there
// are none, make some on the longest bones, which have room.
std::string remedy_for(const MarkerSet& set, const identify::FindSettings& find) {
  MarkerSet listed = set;
  listed.asymmetric = identify::asymmetric_markers(set);
  if (!identify::has_front_back_ambiguity(listed, find)) {
    return "list the pairs that are no mirror images of each other seen from the front: " +
           text_of(set, listed.asymmetric);
  }
  std::vector<MarkerPair> pairs = identify::opposite_markers(set);
  std::erase_if(pairs, [&](const MarkerPair& pair) { return std::ranges::count(listed.asymmetric, pair) > 0; });
  std::ranges::stable_sort(pairs, std::ranges::greater{},
                           [&](const MarkerPair& pair) { return length_m(set.skeleton, set.markers[pair.one].bone); });
  pairs.resize(std::min<std::size_t>(3, pairs.size()));
  return "move one marker of each of these pairs 50 mm along its bone, measure it again, and list the pairs: " +
         text_of(set, pairs);
}

}  // namespace

std::vector<std::string> shape_warnings(const DaemonSettings& settings) {
  const identify::FindSettings find{.min_marker_fraction = settings.label.least_share,
                                    .max_rms_m = settings.label.most_rms_m};
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < settings.subject_models.size(); ++i) {
    const auto& [name, set, fitted] = settings.subject_models[i];
    const bool measured_in_tpose = !fitted && set.skeleton.bones.size() > 1;
    if (!measured_in_tpose || !identify::has_front_back_ambiguity(set, find)) continue;
    warnings.push_back(fmt::format(
        "front and back of subject '{}' in T-pose are exchanged if markers of arms and legs are on the other "
        "side than marker set '{}' says; {}, in {}",
        name, set.name, remedy_for(set, find), settings.subjects[i].marker_set_file.string()));
  }
  return warnings;
}

void check_shapes(DaemonTables& tables, const DaemonSettings& settings) {
  const double least_m = least_difference_m(settings);
  for (std::size_t i = 0; i < settings.subject_models.size(); ++i) {
    check_symmetry(tables.subjects[i], settings.subject_models[i], least_m);
    for (std::size_t j = 0; j < i; ++j)
      check_pair(tables.subjects[i], settings.subject_models[j], settings.subject_models[i], least_m);
  }
}

}  // namespace mocap::settings
