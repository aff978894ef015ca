#include "settings/toml/text_file.h"

#include <utility>

#include "base/read_file.h"

namespace mocap::settings {
namespace {

constexpr std::size_t kMostBytes = 16u << 20;

}  // namespace

Result<std::string, Fault> read_text(const std::filesystem::path& path) {
  const auto fault = [&](std::string message) { return Fault{path, 0, 0, std::move(message)}; };
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return fault("no such file");
  if (std::filesystem::is_directory(status)) return fault("is a folder, expected a file");
  Result<std::string> text = read_file(path, kMostBytes);
  if (text) return *std::move(text);
  if (text.error().code == ErrorCode::InvalidArgument) return fault("is over 16 MB, expected a settings file");
  return fault("cannot be read; check its permissions and its disk");
}

}  // namespace mocap::settings
