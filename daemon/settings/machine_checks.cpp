#include "settings/machine_checks.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "settings/toml/toml_file.h"

namespace mocap::settings {
namespace {

namespace fs = std::filesystem;

// The folder, or its nearest ancestor that exists.
fs::path existing_part(fs::path folder) {
  std::error_code ignored;
  while (folder.has_relative_path() && !fs::exists(folder, ignored)) folder = folder.parent_path();
  return folder.empty() ? fs::path(".") : folder;
}

// Why the process may not create or replace `file`; empty: it may. `makes_folder`: the daemon makes a folder that does
// not exist. Uses the effective user, unlike access(2).
std::string obstacle(const fs::path& file, bool makes_folder) {
  const fs::path named = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const fs::path folder = makes_folder ? existing_part(named) : named;
  std::error_code failed;
  const fs::file_status status = fs::status(folder, failed);
  if (!fs::exists(status)) {
    return fmt::format("the folder '{}' {}; create it", folder.string(),
                       failed && failed != std::errc::no_such_file_or_directory ? failed.message() : "does not exist");
  }
  if (!fs::is_directory(status)) return fmt::format("'{}' is not a folder", folder.string());
  if (fs::is_directory(file, failed)) return fmt::format("'{}' is a folder, expected a file", file.string());
  if (::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) == 0) return {};
  return fmt::format("this user may not write in the folder '{}' ({})", folder.string(), std::strerror(errno));
}

void check_written(TomlTable& table, const char* key, const fs::path& file, bool makes_folder) {
  if (file.empty()) return;
  const std::string why = obstacle(file, makes_folder);
  if (!why.empty()) table.fault(key, fmt::format("{} is '{}', but {}", key, file.string(), why));
}

void check_endpoint_folder(TomlTable& table, const std::string& endpoint) {
  constexpr std::string_view kIpc = "ipc://";
  if (endpoint.starts_with(kIpc) && !endpoint.starts_with("ipc://@")) {
    check_written(table, "endpoint", endpoint.substr(kIpc.size()), false);
  }
}

void check_processors(TomlTable& table, const char* key, const std::vector<int>& wanted) {
  const long count = ::sysconf(_SC_NPROCESSORS_CONF);
  for (const int processor : wanted) {
    if (processor < count) continue;
    table.fault(key, fmt::format("{} has {}, expected processors of this machine, 0 to {}", key, processor, count - 1));
    return;
  }
}

}  // namespace

Faults machine_faults(const DaemonSettings& settings, const fs::path& path, const StateFiles& state) {
  Result<TomlFile, Faults> file = TomlFile::open(path);  // again, for the places of the keys
  if (!file) return file.error();
  TomlTable root = file->root();
  if (std::optional<TomlTable> record = root.table("record", "record")) {
    const auto check_recording = [&](const char* key, const fs::path& recording) {
      check_written(*record, key, recording, state.has(recording));
    };
    check_recording("snapshots", settings.record.snapshots);
    check_recording("blobs", settings.record.blobs);
  }
  if (std::optional<TomlTable> publish = root.table("publish", "publish")) {
    check_endpoint_folder(*publish, settings.publish.endpoint);
  }
  if (std::optional<TomlTable> control = root.table("control", "control")) {
    check_endpoint_folder(*control, settings.control.endpoint);
  }
  if (std::optional<TomlTable> realtime = root.table("realtime", "realtime")) {
    check_processors(*realtime, "camera_cpus", settings.pipeline.camera.thread.cpus);
    check_processors(*realtime, "fusion_cpus", settings.pipeline.fusion.thread.cpus);
    check_processors(*realtime, "publish_cpus", settings.pipeline.publish.thread.cpus);
  }
  std::vector<TomlTable> subjects = root.tables("subject", "subject");
  for (std::size_t i = 0; i < subjects.size() && i < settings.subjects.size(); ++i) {
    subjects[i].call_by("name", "subject");
    check_written(subjects[i], "keep", settings.subjects[i].keep, true);
  }
  return file->faults();
}

}  // namespace mocap::settings
