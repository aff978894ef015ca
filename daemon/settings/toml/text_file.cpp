#include "settings/toml/text_file.h"

#include <fstream>

namespace mocap::settings {
namespace {

constexpr std::size_t kMostBytes = 16u << 20;

}  // namespace

Result<std::string, Fault> read_text(const std::filesystem::path& path) {
  const auto fault = [&](const char* message) { return Fault{path, 0, 0, message}; };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return fault("no such file");
  if (std::filesystem::is_directory(status)) return fault("is a folder, expected a file");
  std::ifstream in(path, std::ios::binary);
  if (!in) return fault("cannot be read; check its permissions");
  std::string text;
  char block[65536];
  while (in.read(block, sizeof block), in.gcount() > 0) {
    text.append(block, static_cast<std::size_t>(in.gcount()));
    if (text.size() > kMostBytes) return fault("is over 16 MB, expected a settings file");
  }
  return text;
}

}  // namespace mocap::settings
