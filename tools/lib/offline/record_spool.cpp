#include "lib/offline/record_spool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "base/expects.h"

namespace mocap::offline {

Result<RecordSpool> RecordSpool::create(const std::filesystem::path& folder) {
  const std::string where = folder.empty() ? "." : folder.string();
  std::string name = where + "/.mocap-offline-XXXXXX";
  const int file = ::mkostemp(name.data(), O_CLOEXEC);
  if (file < 0) {
    return Error{ErrorCode::Io, fmt::format("'{}': no temporary file can be made: {}", where,
                                            std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
  }
  ::unlink(name.c_str());
  return RecordSpool(file, where);
}

RecordSpool::RecordSpool(RecordSpool&& other) noexcept
    : file_(std::exchange(other.file_, -1)), folder_(std::move(other.folder_)), ends_(std::move(other.ends_)) {}

RecordSpool::~RecordSpool() {
  if (file_ >= 0) ::close(file_);
}

Status RecordSpool::append(std::string_view record) {
  const std::uint64_t begin = ends_.empty() ? 0 : ends_.back();
  for (std::size_t done = 0; done < record.size();) {
    const ssize_t written =
        ::pwrite(file_, record.data() + done, record.size() - done, static_cast<off_t>(begin + done));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return failed("written");
    done += static_cast<std::size_t>(written);
  }
  ends_.push_back(begin + record.size());
  return {};
}

Result<std::string> RecordSpool::read(std::size_t index) const {
  MOCAP_EXPECTS(index < ends_.size());
  const std::uint64_t begin = index == 0 ? 0 : ends_[index - 1];
  std::string record(ends_[index] - begin, '\0');
  for (std::size_t done = 0; done < record.size();) {
    const ssize_t got = ::pread(file_, record.data() + done, record.size() - done, static_cast<off_t>(begin + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return failed("read");
    done += static_cast<std::size_t>(got);
  }
  return record;
}

Error RecordSpool::failed(const char* what) const {
  return {ErrorCode::Io, fmt::format("the temporary file in '{}' cannot be {}: {}; free space there", folder_, what,
                                     std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
}

}  // namespace mocap::offline
