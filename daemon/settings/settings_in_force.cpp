#include "settings/settings_in_force.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "settings/daemon_settings.h"
#include "settings/key_list.h"
#include "settings/rig/rig_text.h"
#include "settings/sections.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

// A table of a file, or the absence of one.
struct Source {
  std::filesystem::path file;
  std::optional<TomlTable> table;
};

std::string source_of(const Source& source, const Key& key) {
  const auto line = source.table ? source.table->line_of(key) : std::nullopt;
  return line ? fmt::format("{}:{}", source.file.string(), *line) : "default";
}

void add(InForce& all, const std::string& prefix, const KeyList& list, const Source& source) {
  for (const ListedKey& listed : list.entries()) {
    if (listed.value.empty()) continue;
    all.settings.push_back(
        {fmt::format("{}.{}", prefix, listed.key.name), listed.value, source_of(source, listed.key)});
  }
}

// The tables [[name]] of a file; none if there is no file.
std::vector<Source> tables_of(std::optional<TomlFile>& file, const char* name) {
  std::vector<Source> found;
  if (!file) return found;
  for (TomlTable& table : file->root().tables(name, name)) found.push_back({file->faults().file, table});
  return found;
}

std::optional<TomlFile> open(const std::filesystem::path& path) {
  std::error_code ignored;
  if (path.empty() || !std::filesystem::exists(path, ignored)) return std::nullopt;
  Result<TomlFile, Faults> file = TomlFile::open(path);
  return file ? std::optional(*std::move(file)) : std::nullopt;
}

void add_sections(InForce& all, DaemonSettings& settings, TomlFile& file) {
  for (const Section& section : sections()) {
    KeyList list;
    section.declare(list, settings);
    add(all, section.name, list, {file.faults().file, file.root().table(section.name, section.name)});
  }
}

void add_cameras(InForce& all, DaemonSettings& settings, std::optional<TomlFile>& file) {
  const std::vector<Source> tables = tables_of(file, "camera");
  for (std::size_t i = 0; i < settings.cameras.size(); ++i) {
    KeyList list;
    declare_keys(list, settings.cameras[i]);
    add(all, "camera." + settings.cameras[i].name, list, tables[i]);
  }
}

// Subjects of the configuration come first, then the added ones; an added subject whose name the configuration has is
// left out.
void add_subjects(InForce& all, DaemonSettings& settings, std::optional<TomlFile>& file,
                  std::optional<TomlFile>& added) {
  const std::vector<Source> own = tables_of(file, "subject");
  for (std::size_t i = 0; i < settings.subjects.size(); ++i) {
    SubjectSettings& subject = settings.subjects[i];
    KeyList list;
    declare_keys(list, subject);
    Source source = i < own.size() ? own[i] : Source{};
    for (Source& each : tables_of(added, "subject")) {
      std::string name;
      each.table->text("name", name);
      if (i >= own.size() && name == subject.name) source = each;
    }
    add(all, "subject." + subject.name, list, source);
    const auto kept = std::ranges::find(settings.kept, i, [](const KeptSubject& each) { return each.subject.value; });
    std::error_code ignored;
    const bool from_keep = kept != settings.kept.end() && std::filesystem::exists(kept->path, ignored);
    if (subject.file.empty() && !from_keep) continue;
    all.settings.push_back({fmt::format("subject.{}.body", subject.name), "fitted",
                            (subject.file.empty() ? kept->path : subject.file).string()});
  }
}

void add_masks(InForce& all, const DaemonSettings& settings, const std::filesystem::path& file, const MaskKind& kind) {
  std::optional<TomlFile> masks = open(file);
  for (const CameraModel& camera : settings.rig) {
    std::optional<TomlTable> table = masks ? masks->root().table(camera.name, camera.name) : std::nullopt;
    const auto size = table ? table->list("size", {2}) : std::nullopt;
    const bool from_state = size && (*size)[0] == camera.width_px && (*size)[1] == camera.height_px;
    const std::string source =
        from_state ? source_of({file, table}, {.name = kind.key}) : settings.capture.rig_file.string();
    all.settings.push_back({fmt::format("rig.{}.{}", camera.name, kind.key),
                            fmt::format("{} polygons", (camera.*kind.of).size()),
                            (camera.*kind.of).empty() && !from_state ? "default" : source});
  }
}

std::vector<ReadFile> files_of(const std::filesystem::path& configuration, const DaemonSettings& settings,
                               const StateFiles& state) {
  std::vector<ReadFile> files = {{configuration, "the configuration"}};
  if (state.exist()) files.push_back({state.added_subjects, "subjects added by mocapctl subject add"});
  files.push_back({settings.capture.rig_file, "the rig: calibration and masks"});
  if (state.exist()) files.push_back({state.learnt_masks, "masks learnt by mocapctl mask learn, instead of the rig's"});
  if (state.exist())
    files.push_back({state.drawn_masks, "masks drawn by mocapctl mask draw or on the page, instead of the rig's"});
  for (const SubjectSettings& subject : settings.subjects) {
    for (const auto& path : {subject.marker_set_file, subject.file, subject.file.empty() ? subject.keep : ""}) {
      if (!path.empty()) files.push_back({path, "subject " + subject.name});
    }
  }
  std::error_code ignored;
  for (ReadFile& file : files) file.exists = std::filesystem::exists(file.path, ignored);
  return files;
}

}  // namespace

Result<InForce, Faults> settings_in_force(const std::filesystem::path& configuration, const StateFiles& state) {
  Result<DaemonSettings, Faults> settings = load_daemon_settings(configuration, state);
  if (!settings) return settings.error();
  std::optional<TomlFile> file = open(configuration);
  if (!file) return Faults{configuration, {{configuration, 0, 0, "changed while it was read"}}};
  std::optional<TomlFile> added = open(state.added_subjects);
  InForce all;
  all.files = files_of(configuration, *settings, state);
  all.notes = settings->state_notes;
  add_sections(all, *settings, *file);
  add_cameras(all, *settings, file);
  add_subjects(all, *settings, file, added);
  add_masks(all, *settings, state.drawn_masks, kDrawnMasks);
  add_masks(all, *settings, state.learnt_masks, kLearntMasks);
  return all;
}

}  // namespace mocap::settings
