#include "settings/daemon_settings.h"

#include <fmt/format.h>

#include <algorithm>

#include "settings/cross_checks.h"
#include "settings/key_list.h"
#include "settings/rig/rig_file.h"
#include "settings/sections.h"
#include "settings/subject/subject_models.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {

void declare_keys(KeyVisitor& keys, CaptureSettings& capture) {
  keys.path("rig", capture.rig_file,
            {.help = "calibration of the cameras: one table per camera, found by its name",
             .example = "rig.example.toml",
             .example_is_active = true});
  keys.flag("needs_rig", capture.needs_rig,
            {.help = "false: a camera that is not in the rig is captured without 3D markers until it is calibrated "
                     "(mocapctl calibrate)"});
  keys.number("rate_hz", capture.rate_hz, {0, 10000},
              {.help = "sets per second announced to clients; 0: the rate of the fastest camera"});
}

void declare_keys(KeyVisitor& keys, SubjectSettings& subject) {
  keys.text("name", subject.name,
            {.help = "used in the log and on the wire",
             .example = "actor",
             .required = "the subject's name in the log and on the wire"});
  keys.path("marker_set", subject.marker_set_file,
            {.help = "markers on the bones of a skeleton, beside this file or in share/mocapd; not needed with file",
             .example = "markersets/openmocap18.toml",
             .example_is_active = true});
  keys.path("file", subject.file,
            {.help = "fitted body (mocapctl subject): the subject is recognised in any pose",
             .example = "subjects/actor.toml"});
  keys.path(
      "keep", subject.keep,
      {.help =
           "file for the fits that are made while the daemon runs, read at the next start; a relative name is in the "
           "state folder of the service (/var/lib/mocapd)",
       .example = "subjects/actor.toml"});
}

namespace {

// The keys of a camera whose driver is unknown cannot be judged.
cameras::CameraSettings read_camera(TomlTable& table) {
  cameras::CameraSettings camera;
  table.call_by("name", "camera");
  declare_keys(table, camera);
  if (camera.driver.driver().empty()) {
    table.correct_missing();
    return camera;
  }
  table.add(faults_of(camera));
  table.done();
  return camera;
}

SubjectSettings read_subject(TomlTable& table) {
  SubjectSettings subject;
  table.call_by("name", "subject");
  declare_keys(table, subject);
  if (!subject.marker_set_file.empty()) subject.marker_set_file = table.shipped_file("marker_set").path;
  table.done();
  return subject;
}

// Moves the files that the daemon writes to the state folder, if their names are relative.
void write_into(const std::filesystem::path& folder, DaemonTables& tables, DaemonSettings& settings) {
  for (std::size_t i = 0; i < settings.subjects.size(); ++i) {
    tables.subjects[i].move_to(folder, "keep", settings.subjects[i].keep);
  }
  if (const auto record = tables.sections.find("record"); record != tables.sections.end()) {
    record->second.move_to(folder, "snapshots", settings.record.snapshots);
    record->second.move_to(folder, "blobs", settings.record.blobs);
  }
  if (const auto takes = tables.sections.find("takes"); takes != tables.sections.end()) {
    takes->second.move_to(folder, "folder", settings.takes.folder);
  }
  if (const auto audit = tables.sections.find("audit"); audit != tables.sections.end()) {
    audit->second.move_to(folder, "file", settings.audit.file);
  }
}

// The folder has a default, which a file without the key cannot make relative to itself. The shot list is in the state
// folder, without one beside the takes.
void place_takes(const StateFiles& state, DaemonSettings& settings) {
  const std::filesystem::path base = state.exist() ? state.folder : settings.file.parent_path();
  if (settings.takes.folder == take::TakesSettings{}.folder) settings.takes.folder = base / settings.takes.folder;
  settings.takes.shots = (state.exist() ? state.folder : settings.takes.folder) / "shot_list.csv";
}

// The file has a default, too. Without a state folder it would stand among the files of the operator, so there is none.
void place_audit(const StateFiles& state, DaemonSettings& settings) {
  if (settings.audit.file != audit::AuditSettings{}.file) return;
  settings.audit.file = state.exist() ? state.folder / settings.audit.file : std::filesystem::path();
}

// Adds the subjects of the state file. One that the configuration has under the same name is left out: the operator has
// moved it there.
void read_added_subjects(TomlFile& added, DaemonTables& tables, DaemonSettings& settings) {
  TomlTable root = added.root();
  for (TomlTable& table : root.tables("subject", "added subject")) {
    SubjectSettings subject = read_subject(table);
    if (std::ranges::find(settings.subjects, subject.name, &SubjectSettings::name) != settings.subjects.end()) {
      settings.state_notes.push_back(fmt::format("subject {}: the configuration's is used, not the one of {}",
                                                 subject.name, added.faults().file.string()));
      continue;
    }
    settings.state_notes.push_back(fmt::format("subject {}: added by {}", subject.name, added.faults().file.string()));
    settings.subjects.push_back(std::move(subject));
    tables.subjects.push_back(table);
  }
  root.done();
}

DaemonTables read_tables(TomlFile& file, TomlFile* added, const StateFiles& state, DaemonSettings& settings) {
  DaemonTables tables{file.root(), {}, {}, {}};
  for (const Section& section : sections()) {
    if (std::optional<TomlTable> table = tables.root.table(section.name, section.name)) {
      section.declare(*table, settings);
      table->done();
      tables.sections.emplace(section.name, *std::move(table));
    }
  }
  tables.cameras = tables.root.tables("camera", "camera");
  for (TomlTable& table : tables.cameras) settings.cameras.push_back(read_camera(table));
  tables.subjects = tables.root.tables("subject", "subject");
  for (TomlTable& table : tables.subjects) settings.subjects.push_back(read_subject(table));
  tables.root.done();
  if (added != nullptr) read_added_subjects(*added, tables, settings);
  if (state.exist()) write_into(state.folder, tables, settings);
  place_takes(state, settings);
  place_audit(state, settings);
  return tables;
}

// The entries of the rig file; a camera without an entry gets a model with its name alone.
void load_rig_as_found(TomlFile& file, DaemonSettings& settings) {
  Rig known;
  std::error_code ignored;
  if (!settings.capture.rig_file.empty() && std::filesystem::exists(settings.capture.rig_file, ignored)) {
    Result<Rig, Faults> rig = load_rig(settings.capture.rig_file);
    if (!rig) return file.add(rig.error());
    known = *std::move(rig);
  }
  for (const auto& camera : settings.cameras) {
    const auto found = std::ranges::find(known, camera.name, &CameraModel::name);
    if (found != known.end()) {
      settings.rig.push_back(*found);
    } else {
      settings.rig.emplace_back().name = camera.name;
    }
  }
}

// A missing rig is never replaced by a shipped one: a calibration is true for one installation only.
void load_whole_rig(TomlFile& file, DaemonTables& tables, DaemonSettings& settings) {
  TomlTable& capture = tables.section("capture");
  std::error_code unreadable;
  if (!settings.capture.needs_rig && !std::filesystem::exists(settings.capture.rig_file, unreadable)) {
    settings.rig = rig_for(tables, settings, {});
    return;
  }
  if (settings.capture.rig_file.empty()) {
    constexpr const char* kExpected = "the calibration file of the cameras";
    if (capture.require("rig", kExpected)) capture.fault("rig", fmt::format("rig is '', expected {}", kExpected));
    return;
  }
  std::error_code ignored;
  if (!std::filesystem::exists(settings.capture.rig_file, ignored)) {
    return capture.fault("rig", fmt::format("rig: {}: no such file", settings.capture.rig_file.string()));
  }
  const Result<Rig, Faults> rig = load_rig(settings.capture.rig_file);
  if (!rig) return file.add(rig.error());
  settings.rig = rig_for(tables, settings, *rig);
}

// A rig of requests to calibrate takes the place of the configuration's.
void use_state_rig(const StateFiles& state, DaemonSettings& settings) {
  std::error_code ignored;
  if (!state.exist() || !std::filesystem::exists(state.rig, ignored)) return;
  settings.state_notes.push_back(fmt::format(
      "rig: {} is used, not {}; mocapctl calibrate list shows earlier rigs", state.rig.string(),
      settings.capture.rig_file.empty() ? "that of the configuration" : settings.capture.rig_file.string()));
  settings.capture.rig_file = state.rig;
}

// The reason why a file is not a configuration, if it is another of our files.
std::optional<std::string> other_kind_of_file(TomlTable root) {
  if (root.has("camera") || root.has("capture")) return std::nullopt;
  if (root.has_table_with("translation") && root.has_table_with("matrix")) {
    return "this looks like a rig file; give the configuration, whose [capture] names it with rig = \"...\"";
  }
  if (root.has("marker") && root.has("skeleton")) {
    return "this looks like a marker set; give the configuration, whose [[subject]] names it with marker_set = \"...\"";
  }
  if (root.has("bone")) {
    return "this looks like a skeleton or a subject file; give the configuration, whose [[subject]] names it";
  }
  return std::nullopt;
}

void load_state_masks(TomlFile& file, const StateFiles& state, DaemonSettings& settings) {
  for (const auto& [path, kind] :
       {std::pair(state.learnt_masks, kLearntMasks), std::pair(state.drawn_masks, kDrawnMasks)}) {
    const Result<std::vector<std::string>, Faults> notes = read_masks(path, settings.rig, kind);
    if (!notes) {
      file.add(notes.error());
      continue;
    }
    settings.state_notes.insert(settings.state_notes.end(), notes->begin(), notes->end());
  }
}

double nominal_rate_hz(const DaemonSettings& settings) {
  if (settings.capture.rate_hz > 0.0) return settings.capture.rate_hz;
  double fastest_hz = 0.0;
  for (const auto& camera : settings.cameras) fastest_hz = std::max(fastest_hz, facts_of(camera).rate_hz.value_or(0.0));
  return fastest_hz;
}

}  // namespace

Result<DaemonSettings, Faults> load_daemon_settings(const std::filesystem::path& path, RigNeed need) {
  return load_daemon_settings(path, StateFiles{}, need);
}

Result<DaemonSettings, Faults> load_daemon_settings(const std::filesystem::path& path, const StateFiles& state,
                                                    RigNeed need) {
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return file.error();
  if (const std::optional<std::string> other = other_kind_of_file(file->root())) {
    return Faults{path, {{path, 1, 1, *other}}};
  }
  std::optional<TomlFile> added;
  std::error_code ignored;
  if (state.exist() && std::filesystem::exists(state.added_subjects, ignored)) {
    Result<TomlFile, Faults> opened = TomlFile::open(state.added_subjects);
    if (!opened) return opened.error();
    added = *std::move(opened);
  }
  DaemonSettings settings;
  settings.file = path;
  settings.state = state;
  DaemonTables tables = read_tables(*file, added ? &*added : nullptr, state, settings);
  use_state_rig(state, settings);
  check_together(tables, settings);
  if (need == RigNeed::Whole && !settings.node.on()) {
    load_whole_rig(*file, tables, settings);
  } else {
    load_rig_as_found(*file, settings);
  }
  load_state_masks(*file, state, settings);
  load_subject_models(*file, tables, settings);
  if (added) file->add(added->faults());
  if (!file->faults().list.empty()) return file->faults();
  settings.nominal_rate_hz = nominal_rate_hz(settings);
  return settings;
}

detect::DetectSettings detect_of(const DaemonSettings& settings, CameraId camera) {
  detect::DetectSettings detect = settings.detect;
  const cameras::CameraSettings& own = settings.cameras[camera.value];
  if (own.threshold) detect.threshold = *own.threshold > 0.0 ? own.threshold : std::nullopt;
  if (own.low_threshold) detect.low_threshold = own.low_threshold;
  return detect;
}

std::vector<std::pair<std::string, std::string>> list_settings(const DaemonSettings& settings) {
  DaemonSettings copy = settings;  // a visitor may change fields
  std::vector<std::pair<std::string, std::string>> all;
  const auto add = [&](const std::string& prefix, const KeyList& list) {
    for (const ListedKey& listed : list.entries()) {
      if (!listed.value.empty()) all.emplace_back(fmt::format("{}.{}", prefix, listed.key.name), listed.value);
    }
  };
  for (const Section& section : sections()) {
    KeyList list;
    section.declare(list, copy);
    add(section.name, list);
  }
  for (auto& camera : copy.cameras) {
    KeyList list;
    declare_keys(list, camera);
    add("camera." + camera.name, list);
  }
  for (auto& subject : copy.subjects) {
    KeyList list;
    declare_keys(list, subject);
    add("subject." + subject.name, list);
  }
  return all;
}

}  // namespace mocap::settings
