#include "bridges/status/status_file.h"

#include <fmt/core.h>

#include <cstdlib>
#include <fstream>
#include <system_error>

#ifndef _WIN32
#include <unistd.h>
#endif

namespace mocap::bridge {
namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

fs::path default_path([[maybe_unused]] std::string_view program) {
  // systemd separates several folders by colons; the unit has one.
  if (const std::string folder = environment("RUNTIME_DIRECTORY"); !folder.empty())
    return fs::path(folder) / "status.json";
#ifdef _WIN32
  return {};
#else
  const fs::path folder = geteuid() == 0 ? status_folder_of_services() : status_folder_of_user();
  return folder.empty() ? folder : folder / fmt::format("{}-{}.json", program, getpid());
#endif
}

}  // namespace

fs::path status_folder_of_services() { return "/run/mocap-bridge"; }

fs::path status_folder_of_user() {
  const std::string folder = environment("XDG_RUNTIME_DIR");
  return folder.empty() ? fs::path{} : fs::path(folder) / "mocap-bridge";
}

StatusFile::StatusFile(std::string_view program, const std::string& path)
    : path_(path.empty() ? default_path(program) : fs::path(path)), given_(!path.empty()) {
  std::error_code ignored;
  if (!given_ && !path_.empty()) fs::create_directories(path_.parent_path(), ignored);
}

StatusFile::~StatusFile() {
  std::error_code ignored;
  if (!given_) fs::remove(path_, ignored);
}

void StatusFile::write(std::string_view json) {
  if (path_.empty()) return;
  const fs::path partial = fs::path(path_) += ".new";
  std::ofstream(partial) << json << '\n';
  std::error_code ignored;
  fs::permissions(partial,
                  fs::perms::owner_write | fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read,
                  ignored);
  fs::rename(partial, path_, ignored);
}

}  // namespace mocap::bridge
