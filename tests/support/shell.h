#pragma once

#include <array>
#include <cstdio>
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

/// The standard output of a shell command.
inline std::string output_of(const std::string& command) {
  std::string output;
  FILE* const pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  std::array<char, 4096> block{};
  for (std::size_t count = 0; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;) {
    output.append(block.data(), count);
  }
  ::pclose(pipe);
  return output;
}

}  // namespace mocap::support
