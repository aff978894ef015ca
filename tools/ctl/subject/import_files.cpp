#include "ctl/subject/import_files.h"

#include <fmt/format.h>

#include <array>
#include <span>
#include <system_error>
#include <vector>

#include "base/sync_folder.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;

std::array<fs::path, 3> all_of(const ImportFiles& files) { return {files.skeleton, files.marker_set, files.subject}; }

// "folder/anna.markers.toml.new": the file until all files are written.
fs::path beside(const fs::path& file) { return file.empty() ? fs::path() : fs::path(file.string() + ".new"); }

Status write_files(const ImportFiles& files, const MarkerSet& set, const fs::path& skeleton,
                   const settings::SubjectFile& subject) {
  if (!files.skeleton.empty()) {
    if (const Status saved = settings::save_skeleton(files.skeleton, set.skeleton); !saved) return saved;
  }
  if (const Status saved = settings::save_marker_set(files.marker_set, set, skeleton); !saved) return saved;
  return settings::save_subject(files.subject, subject);
}

// Gives a written file its final name, and the permissions of the file that it replaces.
Status give_final_name(const fs::path& file) {
  std::error_code failed;
  const fs::file_status old = fs::status(file, failed);
  if (fs::is_regular_file(old)) fs::permissions(beside(file), old.permissions(), failed);
  fs::rename(beside(file), file, failed);
  if (!failed) return {};
  return Error{ErrorCode::Io, fmt::format("{}: cannot be written: {}", file.string(), failed.message())};
}

void remove_each(std::span<const fs::path> files) {
  std::error_code ignored;
  for (const fs::path& file : files) {
    if (!file.empty()) fs::remove(file, ignored);
  }
}

}  // namespace

ImportFiles import_files(const fs::path& folder, const std::string& name, bool own_skeleton) {
  const auto file = [&](const char* ending) { return folder / (name + ending); };
  return {own_skeleton ? file(".skeleton.toml") : fs::path(), file(".markers.toml"), file(".subject.toml")};
}

Status check_absent(const ImportFiles& files) {
  for (const fs::path& file : all_of(files)) {
    std::error_code ignored;
    if (file.empty() || !fs::exists(fs::symlink_status(file, ignored))) continue;
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} exists and is kept; expected another --name or --out, or --replace", file.string())};
  }
  return {};
}

Status save_import(const ImportFiles& files, const MarkerSet& set, const fs::path& skeleton,
                   const settings::SubjectFile& subject, bool replace) {
  std::error_code failed;  // the first file that cannot be written tells why
  fs::create_directories(files.subject.parent_path(), failed);
  const ImportFiles written{beside(files.skeleton), beside(files.marker_set), beside(files.subject)};
  Status saved = write_files(written, set, skeleton, subject);
  std::vector<fs::path> named;
  for (const fs::path& file : all_of(files)) {
    if (!saved || file.empty()) continue;
    saved = give_final_name(file);
    if (saved) named.push_back(file);
  }
  if (saved) {
    sync_folder_of(files.subject);
    return {};
  }
  remove_each(all_of(written));
  if (!replace) remove_each(named);
  return saved;
}

}  // namespace mocap::ctl
