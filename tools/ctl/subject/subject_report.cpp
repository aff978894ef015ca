#include "ctl/subject/subject_report.h"

#include <fmt/format.h>

#include <cstddef>
#include <numbers>

namespace mocap::ctl {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;

}  // namespace

Json json_of(const settings::SubjectFile& subject) {
  Json bones = Json::array(), markers = Json::array();
  for (std::size_t b = 0; b < subject.marker_set.skeleton.bones.size(); ++b) {
    const Bone& bone = subject.marker_set.skeleton.bones[b];
    bones.push_back({{"name", bone.name},
                     {"length_mm", bone.parent < 0 ? 0.0 : 1e3 * bone.rest_offset_m.norm()},
                     {"residual_mm", 1e3 * subject.bone_residuals_m[b]}});
  }
  for (std::size_t m = 0; m < subject.marker_set.markers.size(); ++m) {
    markers.push_back(
        {{"name", subject.marker_set.markers[m].name},
         {"bone", subject.marker_set.skeleton.bones[static_cast<std::size_t>(subject.marker_set.markers[m].bone)].name},
         {"residual_mm", 1e3 * subject.marker_residuals_m[m]}});
  }
  return {{"name", subject.name}, {"marker_set", subject.marker_set.name},   {"fitted_on", subject.fitted_on},
          {"size", subject.size}, {"residual_mm", 1e3 * subject.residual_m}, {"bones", bones},
          {"markers", markers}};
}

void print(const settings::SubjectFile& subject) {
  fmt::print("subject {}: {} markers of {}, size {:.3f}, residual {:.1f} mm, fitted {}\n\n", subject.name,
             subject.marker_set.markers.size(), subject.marker_set.name, subject.size, 1e3 * subject.residual_m,
             subject.fitted_on.empty() ? "at an unknown date" : subject.fitted_on);
  fmt::print("{:<16} {:<16} {:>9} {:>12}\n", "bone", "parent", "length mm", "residual mm");
  const auto& bones = subject.marker_set.skeleton.bones;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const bool root = bones[b].parent < 0;
    fmt::print("{:<16} {:<16} {:>9} {:>12.1f}\n", bones[b].name,
               root ? "" : bones[static_cast<std::size_t>(bones[b].parent)].name,
               root ? "" : fmt::format("{:.1f}", 1e3 * bones[b].rest_offset_m.norm()),
               1e3 * subject.bone_residuals_m[b]);
  }
  fmt::print("\n{:<16} {:<16} {:>9} {:>12}\n", "marker", "bone", "offset mm", "residual mm");
  for (std::size_t m = 0; m < subject.marker_set.markers.size(); ++m) {
    const MarkerOnBone& marker = subject.marker_set.markers[m];
    fmt::print("{:<16} {:<16} {:>9.1f} {:>12.1f}\n", marker.name, bones[static_cast<std::size_t>(marker.bone)].name,
               1e3 * marker.offset_m.norm(), 1e3 * subject.marker_residuals_m[m]);
  }
}

Json json_of(const std::vector<functional::FoundJoint>& joints) {
  Json all = Json::array();
  for (const functional::FoundJoint& joint : joints) {
    Json one = {{"bone", joint.bone}, {"parent", joint.parent}, {"rms_mm", 1e3 * joint.rms_m}};
    if (joint.hinge_axis) {
      one["hinge_axis"] = {joint.hinge_axis->x(), joint.hinge_axis->y(), joint.hinge_axis->z()};
      one["hinge_range_deg"] = kDegreesPerRad * joint.hinge_range_rad;
    }
    all.push_back(std::move(one));
  }
  return all;
}

void print(const std::vector<functional::FoundJoint>& joints) {
  if (!joints.empty()) fmt::print("\n{:<16} {:<16} {:>9} hinge\n", "joint of", "with", "moves mm");
  for (const functional::FoundJoint& joint : joints) {
    fmt::print("{:<16} {:<16} {:>9.1f} {}\n", joint.bone, joint.parent, 1e3 * joint.rms_m,
               joint.hinge_axis ? fmt::format("{:.0f} degrees about ({:.2f}, {:.2f}, {:.2f})",
                                              kDegreesPerRad * joint.hinge_range_rad, joint.hinge_axis->x(),
                                              joint.hinge_axis->y(), joint.hinge_axis->z())
                                : "");
  }
}

}  // namespace mocap::ctl
