#pragma once

#include <filesystem>
#include <string>

namespace mocap::support {

/// A path as one word of a shell command, whatever characters the path has but single quotes.
inline std::string quoted(const std::filesystem::path& path) {
  std::string word = "'";
  word += path.string();
  word += '\'';
  return word;
}

}  // namespace mocap::support
