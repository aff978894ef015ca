#include "settings/subject/subject_models.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include "settings/subject/marker_set_file.h"
#include "settings/subject/shape_checks.h"
#include "settings/subject/subject_file.h"

namespace mocap::settings {
namespace {

// The number that the text begins with, if `end` follows it. The text then begins after `end`.
std::optional<std::uint32_t> take_number(std::string_view& text, std::string_view end) {
  std::uint32_t number = 0;
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view after = text.substr(static_cast<std::size_t>(rest - text.data()));
  if (error != std::errc() || !after.starts_with(end)) return std::nullopt;
  text = after.substr(end.size());
  return number;
}

// The fault of a line "marker.toml:3:7: name is ..."; nothing for a line without a place.
std::optional<Fault> fault_from(std::string_view line) {
  for (std::size_t at = line.find(':'); at != std::string_view::npos; at = line.find(':', at + 1)) {
    std::string_view rest = line.substr(at + 1);
    const auto row = take_number(rest, ":");
    const auto column = row ? take_number(rest, ": ") : std::nullopt;
    if (column) return Fault{std::string(line.substr(0, at)), *row, *column, std::string(rest)};
  }
  return std::nullopt;
}

// The marker sets of one configuration. Each file is read once.
class MarkerSets {
 public:
  explicit MarkerSets(TomlFile& file) : file_(file) {}

  // Faults of the set are added at the key of its first user.
  std::optional<MarkerSet> load(TomlTable& user, const std::filesystem::path& path) {
    if (const auto found = loaded_.find(path); found != loaded_.end()) return found->second;
    if (const FoundFile found = user.shipped_file("marker_set"); !found.missing.empty()) {
      user.fault("marker_set", "marker_set: " + found.missing);
      return loaded_[path] = std::nullopt;
    }
    Result<MarkerSet> set = load_marker_set(path);
    if (!set) add_faults(user, path, set.error().message);
    return loaded_[path] = set ? std::optional(*std::move(set)) : std::nullopt;
  }

 private:
  void add_faults(TomlTable& user, const std::filesystem::path& path, const std::string& message) {
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

// The file of the fitted body: `file`, otherwise `keep` if an earlier run has written it; empty: none.
std::filesystem::path stored_body(const SubjectSettings& subject) {
  if (!subject.file.empty()) return subject.file;
  std::error_code ignored;
  return std::filesystem::exists(subject.keep, ignored) ? subject.keep : std::filesystem::path{};
}

bool same_markers(const MarkerSet& a, const MarkerSet& b) {
  const auto same = [](const auto& one, const auto& other) { return one.name == other.name; };
  return std::ranges::equal(a.markers, b.markers, same) && std::ranges::equal(a.skeleton.bones, b.skeleton.bones, same);
}

// The markers and bones of a body that the daemon keeps, if nothing else defines the subject.
MarkerSet without_offsets(MarkerSet set) {
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m.setZero();
  for (MarkerOnBone& marker : set.markers) marker.offset_m.setZero();
  return set;
}

// The fitted body of a subject. Nothing, and faults, if its file cannot be used.
std::optional<SubjectFile> load_body(TomlFile& file, TomlTable& table, const SubjectSettings& subject,
                                     const std::optional<MarkerSet>& named_set) {
  const std::filesystem::path path = stored_body(subject);
  Result<SubjectFile, Faults> body = load_subject(path);
  if (!body) {
    file.add(body.error());
    table.fault(subject.file.empty() ? "keep" : "file", fmt::format("'{}' has faults", path.string()));
    return std::nullopt;
  }
  if (named_set && !same_markers(*named_set, body->marker_set)) {
    table.fault("marker_set",
                fmt::format("marker_set is '{}', but '{}' was fitted with '{}'; expected one and the same",
                            named_set->name, path.string(), body->marker_set.name));
    return std::nullopt;
  }
  return *std::move(body);
}

void load_subject_model(TomlFile& file, TomlTable& table, MarkerSets& sets, const SubjectSettings& subject,
                        DaemonSettings& settings) {
  std::optional<MarkerSet> named_set;
  if (!subject.marker_set_file.empty()) {
    named_set = sets.load(table, subject.marker_set_file);
    if (!named_set) return;
  }
  SubjectFile known{.name = subject.name,
                    .marker_set_file = subject.marker_set_file,
                    .fitted_on = {},
                    .marker_set = {},
                    .bone_residuals_m = {},
                    .marker_residuals_m = {}};
  const bool stored = !stored_body(subject).empty();
  std::optional<MarkerSet> definition = named_set;
  if (stored) {
    std::optional<SubjectFile> body = load_body(file, table, subject, named_set);
    if (!body) return;
    known = *std::move(body);
  } else if (named_set) {
    known.marker_set = *std::move(named_set);
  } else {
    table.require("marker_set", "a file of config/markersets, or a subject's file");
    return;
  }
  if (!subject.file.empty()) definition = known.marker_set;
  settings.definitions.push_back(definition ? *std::move(definition) : without_offsets(known.marker_set));
  settings.subject_models.push_back({subject.name, known.marker_set, stored});
  const SubjectId id{static_cast<std::uint32_t>(settings.subject_models.size() - 1)};
  if (!subject.keep.empty()) settings.kept.push_back({id, subject.keep, std::move(known)});
}

}  // namespace

void load_subject_models(TomlFile& file, DaemonTables& tables, DaemonSettings& settings) {
  MarkerSets sets(file);
  for (std::size_t i = 0; i < settings.subjects.size(); ++i) {
    load_subject_model(file, tables.subjects[i], sets, settings.subjects[i], settings);
  }
  if (settings.subject_models.size() == settings.subjects.size()) check_shapes(tables, settings);
  settings.simulated.resize(settings.cameras.size());
  for (std::size_t i = 0; i < settings.cameras.size(); ++i) {
    if (facts_of(settings.cameras[i]).marker_set.empty()) continue;
    const std::filesystem::path simulated = tables.cameras[i].shipped_file("marker_set").path;
    if (auto set = sets.load(tables.cameras[i], simulated)) settings.simulated[i] = *std::move(set);
  }
}

}  // namespace mocap::settings
