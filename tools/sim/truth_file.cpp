#include "truth_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "wire/codec/json.h"

namespace mocap::sim {

Result<std::unique_ptr<TruthFile>> TruthFile::open(const std::filesystem::path& file, const scene::Volume& volume) {
  std::unique_ptr<TruthFile> truth(new TruthFile(file, volume));
  if (file.empty()) return truth;
  truth->stream_.open(file, std::ios::trunc);
  if (!truth->stream_) {
    return Error{ErrorCode::Io, fmt::format("truth: cannot write '{}': {}", file.string(), std::strerror(errno))};
  }
  return truth;
}

void TruthFile::write(double t_s, Timestamp exposed_at) {
  if (file_.empty()) return;
  volume_.truth(t_s, exposed_at, number_++, snapshot_);
  stream_ << wire::to_json_line(snapshot_) << '\n';
}

Status TruthFile::finish() {
  if (file_.empty()) return {};
  stream_.close();
  if (!stream_) return Error{ErrorCode::Io, fmt::format("truth: '{}' is incomplete: a write failed", file_.string())};
  return {};
}

}  // namespace mocap::sim
