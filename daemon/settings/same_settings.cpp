#include "settings/same_settings.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "settings/key_list.h"
#include "settings/sections.h"

namespace mocap::settings {
namespace {

// Depth at which a movement of a camera is judged: the middle of a usual volume. The largest movement is below the gate
// of a marker (`label.most_gate_m` and the floor of 3D tracks), so that tracks find their markers again.
constexpr double kDepth_m = 4.0;
constexpr double kMaxMove_m = 0.02;

using Values = std::vector<std::pair<std::string, std::string>>;

Values values_of(const KeyList& list) {
  Values values;
  for (const ListedKey& listed : list.entries()) values.emplace_back(listed.key.name, listed.value);
  return values;
}

template <class Settings>
bool same_keys(Settings one, Settings other) {
  KeyList keys_of_one, keys_of_other;
  declare_keys(keys_of_one, one);
  declare_keys(keys_of_other, other);
  return values_of(keys_of_one) == values_of(keys_of_other);
}

// A visitor may change fields, therefore copies.
bool same_driver(cameras::DriverSettings one, cameras::DriverSettings other) {
  KeyList keys_of_one, keys_of_other;
  one.declare(keys_of_one);
  other.declare(keys_of_other);
  return one.driver() == other.driver() && values_of(keys_of_one) == values_of(keys_of_other);
}

bool same_optics(const CameraModel& one, const CameraModel& other) {
  return one.name == other.name && one.width_px == other.width_px && one.height_px == other.height_px &&
         one.lens.kind == other.lens.kind && one.lens.fx_px == other.lens.fx_px && one.lens.fy_px == other.lens.fy_px &&
         one.lens.cx_px == other.lens.cx_px && one.lens.cy_px == other.lens.cy_px &&
         one.lens.distortion == other.lens.distortion &&
         one.camera_from_world.rotation == other.camera_from_world.rotation &&
         one.camera_from_world.translation == other.camera_from_world.translation;
}

bool same_bone(const Bone& one, const Bone& other) {
  const auto same_range = [](const std::optional<AngleRange>& a, const std::optional<AngleRange>& b) {
    if (!a || !b) return a.has_value() == b.has_value();
    return a->min_rad == b->min_rad && a->max_rad == b->max_rad;
  };
  return one.name == other.name && one.parent == other.parent && one.rest_offset_m == other.rest_offset_m &&
         std::ranges::equal(one.rotation_limits, other.rotation_limits, same_range) &&
         one.aliases.unity == other.aliases.unity && one.aliases.unreal == other.aliases.unreal &&
         one.aliases.vrm == other.aliases.vrm;
}

bool same_marker(const MarkerOnBone& one, const MarkerOnBone& other) {
  return one.name == other.name && one.bone == other.bone && one.offset_m == other.offset_m &&
         one.colour == other.colour;
}

bool same_set(const MarkerSet& one, const MarkerSet& other) {
  return one.name == other.name && one.skeleton.name == other.skeleton.name &&
         std::ranges::equal(one.skeleton.bones, other.skeleton.bones, same_bone) &&
         std::ranges::equal(one.markers, other.markers, same_marker) && one.asymmetric == other.asymmetric;
}

bool same_masks(const std::vector<MaskPolygon>& one, const std::vector<MaskPolygon>& other) {
  const auto same_corner = [](const PixelPoint& a, const PixelPoint& b) { return a.v == b.v; };
  return std::ranges::equal(
      one, other, [&](const MaskPolygon& a, const MaskPolygon& b) { return std::ranges::equal(a, b, same_corner); });
}

// World position of the point that a camera without lens distortion sees at a pixel, kDepth_m away.
WorldPoint seen_at(const CameraModel& camera, double x_px, double y_px) {
  const Lens& lens = camera.lens;
  const Eigen::Vector3d in_camera{(x_px - lens.cx_px) / lens.fx_px * kDepth_m,
                                  (y_px - lens.cy_px) / lens.fy_px * kDepth_m, kDepth_m};
  return camera.camera_from_world.inverse() * CameraPoint{in_camera};
}

bool same_security(const DaemonSettings& one, const DaemonSettings& other) {
  return same_section(one, other, "security") && one.server_public_key == other.server_public_key;
}

bool stands_still(const CameraModel& before, const CameraModel& now) {
  const double right = now.width_px, bottom = now.height_px;
  const std::array<std::pair<double, double>, 4> corners{{{0.0, 0.0}, {right, 0.0}, {0.0, bottom}, {right, bottom}}};
  return std::ranges::all_of(corners, [&](const auto& at) {
    return (seen_at(before, at.first, at.second).v - seen_at(now, at.first, at.second).v).norm() <= kMaxMove_m;
  });
}

}  // namespace

bool same_section(const DaemonSettings& one, const DaemonSettings& other, std::string_view section) {
  const auto found = std::ranges::find(sections(), section, &Section::name);
  MOCAP_EXPECTS(found != sections().end());
  DaemonSettings copy_of_one = one, copy_of_other = other;
  KeyList keys_of_one, keys_of_other;
  found->declare(keys_of_one, copy_of_one);
  found->declare(keys_of_other, copy_of_other);
  return values_of(keys_of_one) == values_of(keys_of_other);
}

bool same_feed(const DaemonSettings& one, const DaemonSettings& other) {
  return same_keys(one.publish, other.publish) && same_security(one, other);
}

bool same_control(const DaemonSettings& one, const DaemonSettings& other) {
  const bool same_address = !one.control.endpoint.empty() || one.publish.endpoint == other.publish.endpoint;
  return same_address && same_section(one, other, "control") && same_security(one, other);
}

bool same_device(const DaemonSettings& one, const DaemonSettings& other, CameraId camera) {
  const std::size_t i = camera.value;
  if (i >= one.cameras.size() || i >= other.cameras.size()) return false;
  if (one.cameras[i].name != other.cameras[i].name) return false;
  if (!same_driver(one.cameras[i].driver, other.cameras[i].driver)) return false;
  const bool is_simulated = !other.simulated[i].markers.empty();
  return !is_simulated || (same_optics(one.rig[i], other.rig[i]) && same_set(one.simulated[i], other.simulated[i]));
}

bool same_processing(const DaemonSettings& one, const DaemonSettings& other, CameraId camera) {
  const CameraModel& before = one.rig[camera.value];
  const CameraModel& now = other.rig[camera.value];
  return same_keys(detect_of(one, camera), detect_of(other, camera)) && before.width_px == now.width_px &&
         before.height_px == now.height_px && same_masks(before.masks, now.masks) &&
         same_masks(before.learnt_masks, now.learnt_masks) && same_section(one, other, "track") &&
         same_section(one, other, "reopen") && same_section(one, other, "realtime");
}

bool same_rig(const Rig& one, const Rig& other) { return std::ranges::equal(one, other, same_optics); }

bool same_world(const Rig& one, const Rig& other) {
  std::size_t common = 0, still = 0;
  for (const CameraModel& before : one) {
    const auto now = std::ranges::find(other, before.name, &CameraModel::name);
    if (now == other.end()) continue;
    ++common;
    still += stands_still(before, *now) ? 1 : 0;
  }
  return 2 * still > common;
}

SubjectId same_subject(const DaemonSettings& before, const DaemonSettings& after, SubjectId now) {
  const SubjectSettings& wanted = after.subjects[now.value];
  const auto found = std::ranges::find(before.subjects, wanted.name, &SubjectSettings::name);
  if (found == before.subjects.end()) return {};
  const auto i = static_cast<std::size_t>(found - before.subjects.begin());
  const bool same = same_set(before.definitions[i], after.definitions[now.value]) && found->file == wanted.file;
  return same ? SubjectId{static_cast<std::uint32_t>(i)} : SubjectId{};
}

}  // namespace mocap::settings
