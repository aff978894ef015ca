#include "settings/shape_checks.h"

#include <fmt/format.h>

#include "body/same_shape.h"

namespace mocap::settings {
namespace {

// A marker is found up to the tolerance from its place, and so may one that it is mistaken for: one marker of a shape
// must be further off than both.
double least_difference_m(const DaemonSettings& settings) { return 2.0 * settings.label.rigid_tolerance_m; }

// Two people differ by more than this somewhere.
constexpr double kSameBody_m = 0.005;

constexpr const char* kCure = "move one marker of one of them by 20 mm or more and measure it anew";

void check_itself(TomlTable& table, const Subject& subject, double least_m) {
  const auto mistaken = body::mistaken_for(subject.marker_set, subject.marker_set, least_m);
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
  const bool part = body::mistaken_for(one.marker_set, other.marker_set, least_m).has_value();
  const bool whole = body::mistaken_for(other.marker_set, one.marker_set, least_m).has_value();
  if (part || whole) {
    table.fault("marker_set",
                fmt::format("subject '{}' has the shape of subject '{}' to {:.0f} mm (or is a part of it, "
                            "or it of this), expected shapes that differ; {}",
                            other.name, one.name, 1e3 * least_m, kCure));
  }
  const bool both = one.fitted && other.fitted;
  if (both && body::same_body(one.marker_set, other.marker_set, kSameBody_m)) {
    table.fault("marker_set", fmt::format("subject '{}' is fitted to the same body as subject '{}' ({:.0f} mm alike), "
                                          "expected a fit of its own; fit it anew to the one who wears it",
                                          other.name, one.name, 1e3 * kSameBody_m));
  }
}

}  // namespace

void check_shapes(DaemonTables& tables, const DaemonSettings& settings) {
  const double least_m = least_difference_m(settings);
  for (std::size_t i = 0; i < settings.worn.size(); ++i) {
    check_itself(tables.subjects[i], settings.worn[i], least_m);
    for (std::size_t j = 0; j < i; ++j) check_pair(tables.subjects[i], settings.worn[j], settings.worn[i], least_m);
  }
}

}  // namespace mocap::settings
