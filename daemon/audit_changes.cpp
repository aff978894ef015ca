#include "audit_changes.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>

#include "settings/same_settings.h"

namespace mocap {
namespace {

std::map<std::string, std::string> by_key(const settings::DaemonSettings& settings) {
  std::map<std::string, std::string> values;
  for (auto& [key, value] : settings::list_settings(settings)) values.emplace(std::move(key), std::move(value));
  return values;
}

AuditEntry changed(std::string setting, std::string before, std::string after) {
  return {.what = "changed",
          .details = {{"setting", std::move(setting)}, {"before", std::move(before)}, {"after", std::move(after)}}};
}

void add_settings(const settings::DaemonSettings& before, const settings::DaemonSettings& now,
                  std::vector<AuditEntry>& entries) {
  const auto old_values = by_key(before), new_values = by_key(now);
  std::set<std::string> keys;
  for (const auto& [key, value] : old_values) keys.insert(key);
  for (const auto& [key, value] : new_values) keys.insert(key);
  const auto value_in = [](const auto& values, const std::string& key) {
    const auto found = values.find(key);
    return found == values.end() ? std::string("none") : found->second;
  };
  for (const std::string& key : keys) {
    std::string from = value_in(old_values, key), to = value_in(new_values, key);
    if (from != to) entries.push_back(changed(key, std::move(from), std::move(to)));
  }
}

// How far the centre of a camera moved, and by how much it turned.
std::string movement(const CameraModel& before, const CameraModel& now) {
  const auto centre = [](const CameraModel& camera) -> Eigen::Vector3d {
    return -camera.camera_from_world.rotation.transpose() * camera.camera_from_world.translation;
  };
  const Eigen::Matrix3d turn = now.camera_from_world.rotation * before.camera_from_world.rotation.transpose();
  return fmt::format("moved {:.1f} mm, turned {:.2f} degrees", 1e3 * (centre(now) - centre(before)).norm(),
                     Eigen::AngleAxisd(turn).angle() * 180.0 / std::numbers::pi);
}

bool same_polygon(const MaskPolygon& one, const MaskPolygon& other) {
  return std::ranges::equal(one, other, [](const PixelPoint& a, const PixelPoint& b) { return a.v == b.v; });
}

void add_camera(const CameraModel& before, const CameraModel& now, const std::string& file,
                std::vector<AuditEntry>& entries) {
  if (!settings::same_rig({before}, {now})) {
    entries.push_back(
        {.what = "calibrated", .details = {{"camera", now.name}, {"change", movement(before, now)}, {"file", file}}});
  }
  for (const settings::MaskKind& kind : {settings::kDrawnMasks, settings::kLearntMasks}) {
    const auto& old_masks = before.*kind.of;
    const auto& new_masks = now.*kind.of;
    if (std::ranges::equal(old_masks, new_masks, same_polygon)) continue;
    entries.push_back(changed(fmt::format("{} masks of camera {}", kind.word, now.name),
                              fmt::format("{} polygons", old_masks.size()),
                              fmt::format("{} polygons", new_masks.size())));
  }
}

}  // namespace

std::vector<AuditEntry> audit_changes(const settings::DaemonSettings& before, const settings::DaemonSettings& now) {
  std::vector<AuditEntry> entries;
  add_settings(before, now, entries);
  for (const CameraModel& camera : now.rig) {
    const auto same = std::ranges::find(before.rig, camera.name, &CameraModel::name);
    if (same != before.rig.end()) add_camera(*same, camera, now.capture.rig_file.string(), entries);
  }
  return entries;
}

}  // namespace mocap
