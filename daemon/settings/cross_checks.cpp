#include "settings/cross_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "model/bounds.h"
#include "settings/sections.h"
#include "settings/toml/suggestion.h"

namespace mocap::settings {
namespace {

using cameras::CameraSettings;

std::string twice(std::string_view key, std::string_view value) {
  return fmt::format("{} '{}' is there twice, expected a different one each", key, value);
}

// Adds a fault at the second of two elements that should differ.
template <class Element, class Get>
void expect_different(const std::vector<Element>& elements, std::vector<TomlTable>& tables, const char* key, Get get) {
  for (std::size_t i = 1; i < elements.size(); ++i) {
    const std::string mine = get(elements[i]);
    if (mine.empty()) continue;
    const auto same = [&](const Element& other) { return get(other) == mine; };
    const auto end = elements.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::any_of(elements.begin(), end, same)) {
      tables[i].fault(key, twice(key, mine));
    }
  }
}

// Adds a fault at each key that names the same device as an earlier camera of the make.
void check_devices_differ(DaemonTables& tables, const DaemonSettings& settings) {
  std::set<std::tuple<std::string, std::string, std::string>> seen;
  for (std::size_t i = 0; i < settings.cameras.size(); ++i) {
    const CameraSettings& camera = settings.cameras[i];
    for (const auto& [key, value] : facts_of(camera).device) {
      if (value.empty() || seen.emplace(camera.driver.driver(), key, value).second) continue;
      tables.cameras[i].fault(key, twice(key, value));
    }
  }
}

void check_cameras_differ(DaemonTables& tables, const DaemonSettings& settings) {
  expect_different(settings.cameras, tables.cameras, "name", [](const CameraSettings& camera) { return camera.name; });
  check_devices_differ(tables, settings);
}

void check_camera(TomlTable& table, const CameraSettings& camera) {
  const cameras::CameraFacts facts = facts_of(camera);
  const std::optional<double> rate_hz = facts.rate_hz;
  const std::optional<double> exposure_us = facts.exposure_us;
  if (rate_hz && exposure_us && *exposure_us >= 1e6 / *rate_hz) {
    table.fault("exposure_us", fmt::format("exposure_us is {}, expected less than the period of {:.0f} us at {} Hz",
                                           *exposure_us, 1e6 / *rate_hz, *rate_hz));
  }
}

void check_times(DaemonTables& tables, const DaemonSettings& settings) {
  double fastest_hz = 0.0;
  for (const CameraSettings& camera : settings.cameras)
    fastest_hz = std::max(fastest_hz, facts_of(camera).rate_hz.value_or(0.0));
  const double window_us = to_us(settings.pipeline.align.window);
  if (fastest_hz > 0.0 && window_us >= 0.5e6 / fastest_hz) {
    tables.section("align").fault(
        "window_us", fmt::format("window_us is {}, expected less than half a frame period, {:.0f} at {} Hz", window_us,
                                 0.5e6 / fastest_hz, fastest_hz));
  }
}

// The thresholds of one camera, which may come from two tables.
void check_thresholds(DaemonTables& tables, const DaemonSettings& settings) {
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    const CameraSettings& own = settings.cameras[i];
    const detect::DetectSettings both = detect_of(settings, CameraId{i});
    if (!(own.threshold || own.low_threshold) || !both.threshold || !both.low_threshold) continue;
    if (*both.low_threshold <= *both.threshold) continue;
    tables.cameras[i].fault(own.low_threshold ? "low_threshold" : "threshold",
                            fmt::format("low_threshold is {} for this camera, over its threshold, {}",
                                        *both.low_threshold, *both.threshold));
  }
}

std::vector<std::string> names_of(const Rig& rig) {
  std::vector<std::string> names;
  for (const CameraModel& camera : rig) names.push_back(camera.name);
  return names;
}

// A camera without an entry in the rig: no focal length, and the image size only if the configuration has it.
CameraModel uncalibrated(const CameraSettings& camera) {
  CameraModel model;
  model.name = camera.name;
  model.lens.fx_px = model.lens.fy_px = 0.0;
  if (const std::optional<cameras::ImageSize> size = facts_of(camera).size) {
    model.width_px = size->width_px;
    model.height_px = size->height_px;
  }
  return model;
}

}  // namespace

TomlTable& DaemonTables::section(std::string_view name) {
  const auto found = sections.find(name);
  return found != sections.end() ? found->second : root;
}

void check_together(DaemonTables& tables, const DaemonSettings& settings) {
  // A `camera` that is no list of tables has a fault already.
  if (settings.cameras.empty() && !tables.root.has("camera")) {
    tables.root.fault("no [[camera]], expected at least one");
  }
  if (settings.cameras.size() > kMaxCameras) {
    tables.root.fault(fmt::format("{} [[camera]], expected {} at most", settings.cameras.size(), kMaxCameras));
  }
  if (settings.subjects.size() > kMaxSubjects) {
    tables.root.fault(fmt::format("{} [[subject]], expected {} at most", settings.subjects.size(), kMaxSubjects));
  }
  for (const Section& section : sections()) {
    if (section.faults != nullptr) tables.section(section.name).add(section.faults(settings));
  }
  if (settings.node.on() && !settings.subjects.empty()) {
    tables.subjects[0].fault("a node has no [[subject]]: the fusion host solves the skeletons; move it there");
  }
  check_cameras_differ(tables, settings);
  expect_different(settings.subjects, tables.subjects, "name",
                   [](const SubjectSettings& subject) { return subject.name; });
  for (std::size_t i = 0; i < settings.cameras.size(); ++i) check_camera(tables.cameras[i], settings.cameras[i]);
  check_times(tables, settings);
  check_thresholds(tables, settings);
}

Rig rig_for(DaemonTables& tables, const DaemonSettings& settings, const Rig& rig) {
  Rig ordered;
  for (std::size_t i = 0; i < settings.cameras.size(); ++i) {
    const CameraSettings& camera = settings.cameras[i];
    if (camera.name.empty()) continue;  // has a fault already
    const auto is_it = [&](const CameraModel& model) { return model.name == camera.name; };
    const auto found = std::find_if(rig.begin(), rig.end(), is_it);
    if (found == rig.end() && !settings.capture.needs_rig) {
      if (!facts_of(camera).marker_set.empty()) {
        tables.cameras[i].fault("name", "is not in the rig; a camera that is simulated in this process needs an entry");
      }
      ordered.push_back(uncalibrated(camera));
      continue;
    }
    if (found == rig.end()) {
      tables.cameras[i].fault("name", fmt::format("is not in the rig {}{}", settings.capture.rig_file.string(),
                                                  did_you_mean(camera.name, names_of(rig))));
      continue;
    }
    const std::optional<cameras::ImageSize> size = facts_of(camera).size;
    if (size && (size->width_px != found->width_px || size->height_px != found->height_px)) {
      tables.cameras[i].fault(
          "width_px", fmt::format("size is {}x{} px, but the rig {} was made at {}x{}", size->width_px, size->height_px,
                                  settings.capture.rig_file.string(), found->width_px, found->height_px));
    }
    ordered.push_back(*found);
  }
  return ordered;
}

}  // namespace mocap::settings
