#include "lib/retrack/part_take.h"

#include <fmt/format.h>

#include <utility>

namespace mocap::retrack {

Result<PartTake> PartTake::create(const std::filesystem::path& path, const take::TakeStart& start) {
  Result<PartFile> part = PartFile::begin(path);
  if (!part) return part.error();
  // A crash costs nothing but the time to make the take once more.
  Result<std::unique_ptr<take::TakeWriter>> writer = take::TakeWriter::create(part->path(), start, {.sync = false});
  if (!writer) return writer.error();
  if ((*writer)->path() != part->path().string()) {  // another process began it since
    std::error_code ignored;
    std::filesystem::remove((*writer)->path(), ignored);
    part->forget();
    return Error{ErrorCode::Busy, fmt::format("'{}' is being written by another process", path.string())};
  }
  return PartTake(*std::move(part), *std::move(writer));
}

Result<std::string> PartTake::finish(const take::TakeInfo& info) {
  if (const Status finished = writer_->finish(info); !finished) return finished.error();
  Result<std::filesystem::path> path = part_.publish();
  if (!path) return path.error();
  return path->string();
}

}  // namespace mocap::retrack
