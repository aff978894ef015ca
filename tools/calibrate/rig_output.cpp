#include "calibrate/rig_output.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <optional>
#include <string>
#include <system_error>

#include "calibrate/gather_blobs.h"
#include "settings/rig/kept_rigs.h"

namespace mocap::calibrate {
namespace {

settings::RigPlaces places_of(const std::filesystem::path& path) { return {path, path, path.parent_path() / "rigs"}; }

const char* fault_of_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder, ignored)) return "does not exist";
  return std::filesystem::is_directory(folder, ignored) ? "is not writable" : "is no folder";
}

// Why a rig must not replace the file; nothing without a file.
std::optional<std::string> refusal_to_replace(const std::filesystem::path& path, const Rig& rig) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::nullopt;
  const auto before = settings::load_rig(path);
  if (!before) {
    return fmt::format("{}\n'{}' cannot be read as a rig file and is not replaced; correct it, or use --out FILE",
                       settings::to_text(before.error()), path.string());
  }
  for (const CameraModel& camera : *before) {
    if (std::ranges::find(rig, camera.name, &CameraModel::name) != rig.end()) continue;
    return fmt::format(
        "'{}' of '{}' is not in this recording, and the file is not replaced; use --out FILE, or remove the camera's "
        "table from the file if the camera is gone",
        camera.name, path.string());
  }
  return std::nullopt;
}

}  // namespace

Status check_writable(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(folder, ignored);
  if (is_folder && access(folder.c_str(), W_OK | X_OK) == 0) return {};
  return Error{
      ErrorCode::Io,
      fmt::format("'{}' cannot be written: its folder '{}' {}, expected a writable folder; correct the path, or "
                  "create the folder",
                  path.string(), folder.string(), fault_of_folder(folder))};
}

Result<void, Failure> check_rig_output(const std::filesystem::path& out, const std::filesystem::path& config) {
  const Result<std::filesystem::path, Failure> file =
      out.empty() && !config.empty() ? configured_rig_file(config) : out;
  if (!file) return file.error();
  if (file->empty()) return Failure{kExitUsage, "set the rig file to write with --out FILE, or [capture] rig"};
  Status writable = check_writable(*file);
  std::error_code ignored;
  const std::filesystem::path kept = places_of(*file).kept;
  if (writable && std::filesystem::exists(*file, ignored) && std::filesystem::exists(kept, ignored))
    writable = check_writable(kept / file->filename());
  if (!writable) return Failure{kExitCannotWrite, writable.error().message};
  return {};
}

int write_rig(const std::filesystem::path& path, const Rig& rig, settings::RigMetadata facts, const char* subcommand) {
  facts["solved_by"] = fmt::format("mocap-calibrate {}", subcommand);
  facts["solved_at_utc"] = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  const settings::RigPlaces places = places_of(path);
  if (const auto refused = refusal_to_replace(path, rig)) {
    print_message("{}", *refused);
    const auto kept = settings::keep_rig(places, {rig, std::move(facts)});
    print_message("{}", kept ? fmt::format("the new rig is in '{}'", kept->string()) : kept.error().message);
    return kExitData;
  }
  const auto before = settings::keep_rig_in_force(places);
  const Status saved = before ? settings::save_rig(path, rig, facts) : Status(before.error());
  if (!saved) {
    print_message("{}", saved.error().message);
    return saved.error().code == ErrorCode::InvalidArgument ? kExitData : kExitCannotWrite;
  }
  fmt::print("{}: written; mocapctl reload lets mocapd use it\n", path.string());
  if (!before->empty()) fmt::print("{}: the rig before\n", before->string());
  return kExitOk;
}

Rig with_absent_cameras(Rig rig, const std::filesystem::path& file) {
  const auto before = settings::load_rig(file);
  if (!before) return rig;
  for (const CameraModel& camera : *before) {
    if (std::ranges::find(rig, camera.name, &CameraModel::name) != rig.end()) continue;
    fmt::print("camera {}: not in this recording, taken over from '{}'\n", camera.name, file.string());
    rig.push_back(camera);
  }
  return rig;
}

}  // namespace mocap::calibrate
