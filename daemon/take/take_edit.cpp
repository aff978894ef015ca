#include "take/take_edit.h"

#include <fmt/core.h>

#include <cerrno>
#include <functional>
#include <utility>

#include "base/move_file.h"
#include "take/recordings/disk_reason.h"
#include "take/recordings/output_file.h"
#include "take/take_reader.h"

namespace mocap::take {
namespace {

TakeInfo edited(TakeInfo info, const TakeEdit& edit) {
  if (edit.name) info.name = *edit.name;
  if (edit.slate) info.slate = *edit.slate;
  if (edit.number) info.number = *edit.number;
  if (edit.notes) info.notes = *edit.notes;
  if (edit.tags) info.tags = *edit.tags;
  if (edit.rating) info.rating = *edit.rating;
  return info;
}

// Reads the info, changes it and writes it while no other process changes the file.
Result<TakeInfo> change_info(const std::filesystem::path& path,
                             const std::function<Result<TakeInfo>(const TakeReader&)>& change) {
  Result<TakeInfo> changed = TakeInfo();
  const Status added = mcap::add_metadata(path, [&]() -> Result<mcap::Metadata> {
    const Result<TakeReader> reader = TakeReader::open(path);
    if (!reader) return reader.error();
    changed = change(*reader);
    if (!changed) return changed.error();
    return encode(*changed);
  });
  if (!added) return added.error();
  return changed;
}

// The fault of one message; nothing if it can be decoded.
std::optional<Error> fault_of(const TakeRecord& record) {
  const auto error_of = [](const auto& result) {
    return result ? std::optional<Error>() : std::optional<Error>(result.error());
  };
  switch (record.topic) {
    case TakeTopic::Description: return error_of(description_of(record));
    case TakeTopic::Snapshot: return error_of(snapshot_of(record));
    case TakeTopic::Blobs: return error_of(blobs_of(record));
    case TakeTopic::Health: return error_of(health_of(record));
    case TakeTopic::Event: return error_of(event_of(record));
    case TakeTopic::Other: break;
  }
  return std::nullopt;
}

constexpr std::size_t kMaxFaults = 1000;

std::string free_name_beside(const std::filesystem::path& path) {
  for (int number = 2; number <= kLargestNumber; ++number) {
    const std::string name = fmt::format("{}-{}{}", path.stem().string(), number, path.extension().string());
    if (!std::filesystem::exists(path.parent_path() / name)) return path.stem().string() + fmt::format("-{}", number);
  }
  return "another name";
}

}  // namespace

Result<TakeInfo> edit_take(const std::filesystem::path& path, const TakeEdit& edit) {
  return change_info(path, [&](const TakeReader& reader) -> Result<TakeInfo> {
    TakeInfo info = edited(reader.info(), edit);
    if (const Status valid = check(info); !valid) return valid.error();
    return info;
  });
}

Result<mcap::Repair> repair_take(const std::filesystem::path& path) {
  const Result<mcap::Repair> repair = mcap::repair_file(path);
  if (!repair) return repair;
  const Result<TakeInfo> noted = change_info(path, [](const TakeReader& reader) -> Result<TakeInfo> {
    TakeInfo info = reader.info();
    if (!info.ended_at) info.ended_at = reader.last_at();
    info.repaired = true;
    return info;
  });
  if (!noted) return noted.error();
  return repair;
}

Result<std::vector<mcap::Damage>> verify_take(const std::filesystem::path& path) {
  Result<std::vector<mcap::Damage>> faults = mcap::verify_file(path);
  if (!faults) return faults;
  const Result<TakeReader> reader = TakeReader::open(path);
  if (!reader) return reader.error();
  TakeCursor cursor = reader->messages();
  while (faults->size() < kMaxFaults) {
    const Result<std::optional<TakeRecord>> record = cursor.next();
    if (!record) {
      if (faults->empty()) faults->push_back({0, 0, record.error().message});
      continue;  // behind the damaged chunk, which verify_file has named
    }
    if (!*record) break;
    if (const auto fault = fault_of(**record)) faults->push_back({0, 0, fault->message});
  }
  return faults;
}

Result<std::filesystem::path> rename_take(const std::filesystem::path& path, const std::string& name) {
  if (name.empty() || name.front() == '.' || name.find('/') != std::string::npos) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("'{}' cannot be the name of a take: expected letters without '/' or '.' at the start", name)};
  }
  const std::filesystem::path renamed = path.parent_path() / (name + path.extension().string());
  if (move_without_replacing(path, renamed)) return renamed;
  if (errno == ENOENT) return Error{ErrorCode::NotFound, fmt::format("'{}' does not exist", path.string())};
  if (errno == EEXIST) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("'{}' exists; the next free name is '{}'", renamed.string(), free_name_beside(renamed))};
  }
  return Error{ErrorCode::Io,
               fmt::format("'{}' cannot be renamed to '{}': {}", path.string(), renamed.string(), disk_reason(errno))};
}

}  // namespace mocap::take
