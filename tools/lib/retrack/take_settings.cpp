#include "lib/retrack/take_settings.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>

#include "settings/packed_files.h"
#include "settings/rig/rig_file.h"
#include "settings/subject/subject_file.h"
#include "settings/toml/text_file.h"
#include "take/take_belief.h"

namespace mocap::retrack {
namespace {

namespace fs = std::filesystem;

using settings::DaemonSettings;

// A folder that the destructor removes.
class WorkFolder {
 public:
  static Result<WorkFolder> create() {
    std::error_code failed;
    std::string name = (fs::temp_directory_path(failed) / "mocap-retrack-XXXXXX").string();
    if (failed || ::mkdtemp(name.data()) == nullptr) {
      return Error{ErrorCode::Io, fmt::format("the folder '{}' cannot be made; set $TMPDIR to another place", name)};
    }
    return WorkFolder(name);
  }
  WorkFolder(WorkFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  WorkFolder& operator=(WorkFolder&&) = delete;
  ~WorkFolder() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }

  const fs::path& path() const noexcept { return path_; }

 private:
  explicit WorkFolder(fs::path path) : path_(std::move(path)) {}

  fs::path path_;
};

Error as_error(const settings::Faults& faults) { return {ErrorCode::InvalidArgument, settings::to_text(faults)}; }

Result<std::vector<settings::PackedFile>> files_of(const take::TakeReader& take) {
  std::vector<settings::PackedFile> files;
  for (const std::string& name : take.files()) {
    if (name == take::kBeliefFile) continue;
    Result<std::string> bytes = take.file(name);
    if (!bytes) return bytes.error();
    files.push_back({name, *std::move(bytes)});
  }
  return files;
}

// The settings, and the files of the take that they were read from.
Result<TakeSettings> load_own(const take::TakeReader& take) {
  const Result<WorkFolder> folder = WorkFolder::create();
  if (!folder) return folder.error();
  const Result<std::vector<settings::PackedFile>> files = files_of(take);
  if (!files) return files.error();
  const auto unpacked = settings::unpack_files(*files, folder->path());
  if (!unpacked) {
    return Error{unpacked.error().code,
                 fmt::format("'{}': {}; give one with --settings", take.mcap().path(), unpacked.error().message)};
  }
  Result<DaemonSettings, settings::Faults> loaded =
      settings::load_daemon_settings(unpacked->configuration, unpacked->state);
  if (!loaded) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{}\n'{}': its configuration cannot be used here; give another one with --settings",
                             settings::to_text(loaded.error()), take.mcap().path())};
  }
  TakeSettings own{std::make_unique<DaemonSettings>(*std::move(loaded)), {}};
  for (const settings::PackedFile& file : *files) own.files.push_back({.name = file.name, .bytes = file.bytes});
  return own;
}

Result<TakeSettings> load_other(const fs::path& configuration) {
  Result<DaemonSettings, settings::Faults> loaded = settings::load_daemon_settings(configuration);
  if (!loaded) return as_error(loaded.error());
  TakeSettings other{std::make_unique<DaemonSettings>(*std::move(loaded)), {}};
  for (settings::PackedFile& file : settings::pack_files(*other.settings)) {
    other.files.push_back({.name = std::move(file.name), .bytes = std::move(file.bytes)});
  }
  return other;
}

// Replaces the file of this name, or those of the whole folder if `name` ends with '/'.
void replace_files(std::vector<TakeFile>& files, const std::string& name, TakeFile by) {
  std::erase_if(files, [&](const TakeFile& file) {
    return name.ends_with('/') ? file.name.starts_with(name) : file.name == name;
  });
  files.push_back(std::move(by));
}

Result<std::string> text_of(const fs::path& path) {
  const Result<std::string, settings::Fault> text = settings::read_text(path);
  if (!text) return Error{ErrorCode::NotFound, settings::to_text(text.error())};
  return *text;
}

Status use_rig(const fs::path& path, TakeSettings& into) {
  const Result<Rig, settings::Faults> rig = settings::load_rig(path);
  if (!rig) return as_error(rig.error());
  for (CameraModel& camera : into.settings->rig) {
    const auto found = std::ranges::find(*rig, camera.name, &CameraModel::name);
    if (found == rig->end()) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("{}: has no camera '{}', expected all cameras of the configuration", path.string(), camera.name)};
    }
    if (found->width_px != camera.width_px || found->height_px != camera.height_px) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("{}: camera '{}': size is {}x{}, expected {}x{}, the size of its images", path.string(),
                               camera.name, found->width_px, found->height_px, camera.width_px, camera.height_px)};
    }
    camera = *found;
  }
  const Result<std::string> text = text_of(path);
  if (!text) return text.error();
  replace_files(into.files, "rig/", {.name = "rig/" + path.filename().string(), .bytes = *text});
  return {};
}

bool same_parts(const MarkerSet& one, const MarkerSet& other) {
  const auto same_name = [](const auto& a, const auto& b) { return a.name == b.name; };
  return std::ranges::equal(one.markers, other.markers, same_name) &&
         std::ranges::equal(one.skeleton.bones, other.skeleton.bones, same_name);
}

Status use_bodies(const fs::path& folder, TakeSettings& into) {
  std::size_t used = 0;
  for (Subject& subject : into.settings->subject_models) {
    const fs::path path = folder / (subject.name + ".toml");
    std::error_code ignored;
    if (!fs::exists(path, ignored)) continue;
    const auto body = settings::load_subject(path);
    if (!body) return as_error(body.error());
    if (!same_parts(body->marker_set, subject.marker_set)) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("{}: was fitted with '{}', but subject '{}' has '{}'; expected the same markers and bones",
                      path.string(), body->marker_set.name, subject.name, subject.marker_set.name)};
    }
    subject.marker_set = body->marker_set;
    subject.fitted = true;
    const Result<std::string> text = text_of(path);
    if (!text) return text.error();
    const std::string name = settings::name_of_body(subject.name);
    replace_files(into.files, name, {.name = name, .bytes = *text});
    ++used;
  }
  if (used > 0) return {};
  return Error{ErrorCode::NotFound,
               fmt::format("{}: has the body of no subject, expected a file NAME.toml for a subject NAME of the "
                           "configuration",
                           folder.string())};
}

bool same_offsets(const MarkerSet& one, const MarkerSet& other) {
  const auto same_rest = [](const Bone& a, const Bone& b) { return a.rest_offset_m == b.rest_offset_m; };
  const auto same_offset = [](const MarkerOnBone& a, const MarkerOnBone& b) { return a.offset_m == b.offset_m; };
  return std::ranges::equal(one.skeleton.bones, other.skeleton.bones, same_rest) &&
         std::ranges::equal(one.markers, other.markers, same_offset);
}

}  // namespace

Result<TakeSettings> load_take_settings(const take::TakeReader& take, const OtherFiles& others) {
  Result<TakeSettings> loaded = others.settings.empty() ? load_own(take) : load_other(others.settings);
  if (!loaded) return loaded;
  if (!others.rig.empty()) {
    if (const Status used = use_rig(others.rig, *loaded); !used) return used.error();
  }
  if (!others.subjects.empty()) {
    if (const Status used = use_bodies(others.subjects, *loaded); !used) return used.error();
  }
  return loaded;
}

void use_bodies(const Description& description, DaemonSettings& settings) {
  for (Subject& subject : settings.subject_models) {
    const auto known = std::ranges::find(description.subjects, subject.name, &Subject::name);
    if (known == description.subjects.end() || !same_parts(known->marker_set, subject.marker_set)) continue;
    if (same_offsets(known->marker_set, subject.marker_set)) continue;
    MarkerSet& set = subject.marker_set;
    for (std::size_t i = 0; i < set.skeleton.bones.size(); ++i) {
      set.skeleton.bones[i].rest_offset_m = known->marker_set.skeleton.bones[i].rest_offset_m;
    }
    for (std::size_t i = 0; i < set.markers.size(); ++i)
      set.markers[i].offset_m = known->marker_set.markers[i].offset_m;
    subject.fitted = true;
  }
}

}  // namespace mocap::retrack
