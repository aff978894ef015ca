#include "settings/rig/kept_rigs.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <ctime>
#include <functional>
#include <optional>

#include "base/list_folder.h"
#include "base/read_file.h"
#include "base/replace_file.h"
#include "settings/rig/rig_file.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

constexpr std::size_t kMostListed = 200;
constexpr const char* kSuffix = ".toml";

// Nothing if there is no such file.
Result<std::optional<std::string>> bytes_of(const std::filesystem::path& path) {
  Result<std::string> bytes = path.empty() ? Error{ErrorCode::NotFound, {}} : read_file(path);
  if (bytes) return std::optional(*std::move(bytes));
  if (bytes.error().code == ErrorCode::NotFound) return std::optional<std::string>();
  return bytes.error();
}

std::vector<std::filesystem::path> kept_files(const RigPlaces& places) {
  std::vector<std::filesystem::path> files;
  for (const std::filesystem::path& file : list_folder(places.kept).paths) {  // a missing folder has no rigs
    if (file.extension() == kSuffix) files.push_back(file);
  }
  std::ranges::sort(files, std::greater<>{}, [](const auto& file) { return file.stem().string(); });
  return files;
}

std::string utc_name(std::time_t at) { return fmt::format("{:%Y-%m-%dT%H-%M-%SZ}", fmt::gmtime(at)); }

std::time_t written_at(const std::filesystem::path& path) {
  std::error_code failed;
  const auto at = std::filesystem::last_write_time(path, failed);
  if (failed) return std::time(nullptr);
  return std::chrono::system_clock::to_time_t(
      std::chrono::time_point_cast<std::chrono::system_clock::duration>(std::chrono::file_clock::to_sys(at)));
}

// A path in the folder of kept rigs that no file has yet.
std::filesystem::path free_path(const RigPlaces& places, const std::string& name) {
  std::filesystem::path path = places.kept / (name + kSuffix);
  std::error_code ignored;
  for (int i = 2; std::filesystem::exists(path, ignored); ++i) {
    path = places.kept / fmt::format("{}-{}{}", name, i, kSuffix);
  }
  return path;
}

Status make_folder(const RigPlaces& places) {
  std::error_code failed;
  std::filesystem::create_directories(places.kept, failed);
  if (!failed) return {};
  return Error{ErrorCode::Io, fmt::format("'{}' cannot be created: {}; make its folder writable", places.kept.string(),
                                          failed.message())};
}

void read_facts(const std::filesystem::path& path, KeptRig& kept) {
  Result<TomlFile, Faults> file = TomlFile::open(path);
  if (!file) return;
  std::optional<TomlTable> facts = file->root().table(kRigMetadata, kRigMetadata);
  if (!facts) return;
  if (facts->has("solved_at_utc")) facts->text("solved_at_utc", kept.solved_at_utc);
  if (facts->has("solved_by")) facts->text("solved_by", kept.solved_by);
  if (facts->has("rms_px")) facts->number("rms_px", kept.rms_px, {0, 1e6});
}

}  // namespace

Result<RigPlaces> rig_places(const DaemonSettings& settings) {
  const std::filesystem::path& in_force = settings.capture.rig_file;
  if (settings.state.exist()) return RigPlaces{in_force, settings.state.rig, settings.state.folder / "rigs"};
  if (in_force.empty()) {
    return Error{ErrorCode::InvalidArgument,
                 "there is no rig file to write: set [capture] rig, or start mocapd with --state"};
  }
  return RigPlaces{in_force, in_force, in_force.parent_path() / "rigs"};
}

Result<std::filesystem::path> keep_rig_in_force(const RigPlaces& places) {
  const Result<std::optional<std::string>> bytes = bytes_of(places.in_force);
  if (!bytes) return bytes.error();
  if (!*bytes) return std::filesystem::path();
  for (const auto& file : kept_files(places)) {
    if (const auto kept = bytes_of(file); kept && *kept == *bytes) return file;
  }
  if (const Status made = make_folder(places); !made) return made.error();
  const std::filesystem::path copy = free_path(places, utc_name(written_at(places.in_force)));
  if (const Status written = replace_file(copy, **bytes); !written) return written.error();
  return copy;
}

Result<std::filesystem::path> keep_rig(const RigPlaces& places, const CalibratedRig& rig) {
  if (const Status made = make_folder(places); !made) return made.error();
  const std::filesystem::path copy = free_path(places, utc_name(std::time(nullptr)));
  if (const Status saved = save_rig(copy, rig.rig, rig.facts); !saved) return saved.error();
  return copy;
}

Status write_rig(const RigPlaces& places, const CalibratedRig& rig) {
  if (const auto kept = keep_rig_in_force(places); !kept) return kept.error();
  RigMetadata facts = rig.facts;
  if (KeptRig before; !facts.contains("rms_px")) {  // only the world frame is new
    read_facts(places.in_force, before);
    if (before.rms_px > 0.0) facts["rms_px"] = before.rms_px;
  }
  facts["solved_by"] = std::string("mocapd");
  facts["solved_at_utc"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  const Result<std::filesystem::path> copy = keep_rig(places, {rig.rig, facts});
  if (!copy) return copy.error();
  const Result<std::string> bytes = read_file(*copy);
  if (!bytes) return bytes.error();
  return replace_file(places.written, *bytes);
}

Status restore_rig(const RigPlaces& places, const std::string& name) {
  const std::vector<std::filesystem::path> files = kept_files(places);
  const auto found =
      std::ranges::find(files, name + kSuffix, [](const auto& file) { return file.filename().string(); });
  if (found == files.end()) {
    return Error{ErrorCode::NotFound, fmt::format("there is no rig '{}' in '{}'; mocapctl calibrate list names them",
                                                  name, places.kept.string())};
  }
  if (const auto rig = load_rig(*found); !rig) return Error{ErrorCode::InvalidArgument, to_text(rig.error())};
  const Result<std::string> bytes = read_file(*found);
  if (!bytes) return bytes.error();
  if (const auto kept = keep_rig_in_force(places); !kept) return kept.error();
  return replace_file(places.written, *bytes);
}

Result<std::optional<std::string>> written_rig(const RigPlaces& places) { return bytes_of(places.written); }

Status undo_rig(const RigPlaces& places, const std::optional<std::string>& bytes) {
  if (bytes) return replace_file(places.written, *bytes);
  std::error_code failed;
  std::filesystem::remove(places.written, failed);
  if (!failed) return {};
  return Error{ErrorCode::Io, fmt::format("'{}' cannot be removed: {}", places.written.string(), failed.message())};
}

std::vector<KeptRig> list_rigs(const RigPlaces& places) {
  const Result<std::optional<std::string>> in_force = bytes_of(places.in_force);
  std::vector<KeptRig> all;
  for (const auto& file : kept_files(places)) {
    if (all.size() == kMostListed) break;
    KeptRig& kept = all.emplace_back();
    kept.name = file.stem().string();
    const Result<std::optional<std::string>> bytes = bytes_of(file);
    kept.in_force = in_force && *in_force && bytes && *bytes == *in_force;
    if (const auto rig = load_rig(file)) kept.cameras = static_cast<std::uint32_t>(rig->size());
    read_facts(file, kept);
  }
  return all;
}

}  // namespace mocap::settings
