#include "settings/daemon_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <regex>
#include <sstream>

#include "settings/camera_keys.h"
#include "settings/cross_checks.h"
#include "settings/key_list.h"
#include "settings/marker_set_file.h"
#include "settings/rig_file.h"
#include "settings/shape_checks.h"
#include "settings/stage_keys.h"
#include "settings/toml_file.h"

namespace mocap::settings {
namespace {

void tell(Keys& keys, SubjectSettings& subject) {
  keys.text("name", subject.name);
  keys.path("marker_set", subject.marker_set_file);
}

DaemonTables read_tables(TomlFile& file, DaemonSettings& settings) {
  DaemonTables tables{file.root(), {}, {}};
  for (const Section& section : sections()) {
    if (std::optional<TomlTable> table = tables.root.table(section.name, section.name)) {
      section.tell(*table, settings);
      table->done();
    }
  }
  tables.cameras = tables.root.tables("camera", "camera");
  for (TomlTable& table : tables.cameras) settings.cameras.push_back(read_camera(table));
  tables.subjects = tables.root.tables("subject", "subject");
  for (TomlTable& table : tables.subjects) {
    SubjectSettings& subject = settings.subjects.emplace_back();
    tell(table, subject);
    if (!subject.name.empty()) table.call(fmt::format("subject '{}'", subject.name));
    if (subject.name.empty()) table.require("name", "the subject's name in the log and on the wire");
    table.done();
  }
  tables.root.done();
  return tables;
}

void load_the_rig(TomlFile& file, DaemonTables& tables, DaemonSettings& settings) {
  std::optional<TomlTable> capture = tables.root.table("capture", "capture");
  if (settings.capture.rig_file.empty()) {
    (capture ? *capture : tables.root).fault("rig", "rig is missing, expected the calibration file of the cameras");
    return;
  }
  const Result<Rig, Faults> rig = load_rig(settings.capture.rig_file);
  if (!rig) return file.add(rig.error());
  settings.rig = rig_for(tables, settings, *rig);
}

// "marker.toml:3:7: name is ..." as a fault; nothing for a line without a place.
std::optional<Fault> fault_from(const std::string& line) {
  static const std::regex kPlaced("(.*?):([0-9]{1,9}):([0-9]{1,9}): (.*)");
  std::smatch parts;
  if (!std::regex_match(line, parts, kPlaced)) return std::nullopt;
  return Fault{parts[1].str(), static_cast<std::uint32_t>(std::stoul(parts[2])),
               static_cast<std::uint32_t>(std::stoul(parts[3])), parts[4].str()};
}

// The marker sets of one configuration, each read once.
class MarkerSets {
 public:
  explicit MarkerSets(TomlFile& file) : file_(file) {}

  // What is wrong with the set is told at its first user's key.
  std::optional<MarkerSet> load(TomlTable& user, const std::filesystem::path& path) {
    if (const auto found = loaded_.find(path); found != loaded_.end()) return found->second;
    Result<MarkerSet> set = load_marker_set(path);
    if (!set) tell_faults(user, path, set.error().message);
    return loaded_[path] = set ? std::optional(*std::move(set)) : std::nullopt;
  }

 private:
  void tell_faults(TomlTable& user, const std::filesystem::path& path, const std::string& message) {
    Faults placed{path, {}};
    std::istringstream lines(message);
    for (std::string line; std::getline(lines, line);) {
      if (std::optional<Fault> fault = fault_from(line)) placed.list.push_back(*std::move(fault));
    }
    file_.add(placed);
    user.fault("marker_set", placed.list.empty() ? fmt::format("marker_set: {}", message)
                                                 : fmt::format("marker_set is '{}', which has faults", path.string()));
  }

  TomlFile& file_;
  std::map<std::filesystem::path, std::optional<MarkerSet>> loaded_;
};

void load_the_marker_sets(TomlFile& file, DaemonTables& tables, DaemonSettings& settings) {
  MarkerSets sets(file);
  for (std::size_t i = 0; i < settings.subjects.size(); ++i) {
    const SubjectSettings& subject = settings.subjects[i];
    if (subject.marker_set_file.empty()) {
      tables.subjects[i].require("marker_set", "a file of config/markersets");
    } else if (auto worn = sets.load(tables.subjects[i], subject.marker_set_file)) {
      settings.worn.push_back({subject.name, *std::move(worn)});
    }
  }
  if (settings.worn.size() == settings.subjects.size()) check_shapes(tables, settings);
  settings.simulated.resize(settings.cameras.size());
  for (std::size_t i = 0; i < settings.cameras.size(); ++i) {
    const auto* synthetic = std::get_if<cameras::SyntheticSettings>(&settings.cameras[i].driver);
    if (synthetic == nullptr || synthetic->marker_set.empty()) continue;
    if (auto worn = sets.load(tables.cameras[i], synthetic->marker_set)) settings.simulated[i] = *std::move(worn);
  }
}

double nominal_rate_hz(const DaemonSettings& settings) {
  if (settings.capture.rate_hz > 0.0) return settings.capture.rate_hz;
  double fastest_hz = 0.0;
  for (const auto& camera : settings.cameras) fastest_hz = std::max(fastest_hz, rate_hz_of(camera).value_or(0.0));
  return fastest_hz;
}

}  // namespace

Result<DaemonSettings, Faults> load_daemon_settings(const std::filesystem::path& path) {
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return file.error();
  DaemonSettings settings;
  DaemonTables tables = read_tables(*file, settings);
  check_together(tables, settings);
  load_the_rig(*file, tables, settings);
  load_the_marker_sets(*file, tables, settings);
  if (!file->faults().list.empty()) return file->faults();
  settings.nominal_rate_hz = nominal_rate_hz(settings);
  return settings;
}

stages::DetectSettings detect_of(const DaemonSettings& settings, CameraId camera) {
  stages::DetectSettings detect = settings.detect;
  const cameras::CameraSettings& own = settings.cameras[camera.value];
  if (own.threshold) detect.threshold = *own.threshold > 0.0 ? own.threshold : std::nullopt;
  if (own.low_threshold) detect.low_threshold = own.low_threshold;
  return detect;
}

std::vector<std::pair<std::string, std::string>> list_settings(const DaemonSettings& settings) {
  DaemonSettings copy = settings;  // telling may write
  std::vector<std::pair<std::string, std::string>> all;
  const auto add = [&](const std::string& prefix, const KeyList& list) {
    for (const auto& [key, value] : list.entries()) {
      if (!value.empty()) all.emplace_back(prefix + "." + key, value);
    }
  };
  for (const Section& section : sections()) {
    KeyList list;
    section.tell(list, copy);
    add(section.name, list);
  }
  for (auto& camera : copy.cameras) {
    KeyList list;
    settings::tell(list, camera);
    add("camera." + camera.name, list);
  }
  for (auto& subject : copy.subjects) {
    KeyList list;
    tell(list, subject);
    add("subject." + subject.name, list);
  }
  return all;
}

}  // namespace mocap::settings
