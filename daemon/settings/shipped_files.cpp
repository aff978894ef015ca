#include "settings/shipped_files.h"

#include <fmt/format.h>

#include <system_error>

#include "base/install_folders.h"

namespace mocap::settings {

FoundFile find_file(const std::filesystem::path& named, const std::filesystem::path& beside,
                    const std::filesystem::path& shipped) {
  std::error_code ignored;
  const std::filesystem::path first = (beside / named).lexically_normal();
  if (std::filesystem::exists(first, ignored)) return {first, {}};
  const std::filesystem::path second = (shipped / named).lexically_normal();
  if (named.is_absolute() || shipped.empty() || *second.lexically_relative(shipped.parent_path()).begin() == "..") {
    return {first, fmt::format("{}: no such file", first.string())};
  }
  if (std::filesystem::exists(second, ignored)) return {second, {}};
  return {first, fmt::format("neither {} nor {} exists", first.string(), second.string())};
}

FoundFile find_shipped(const std::filesystem::path& named, const std::filesystem::path& beside) {
  return find_file(named, beside, install_folders().data);
}

}  // namespace mocap::settings
