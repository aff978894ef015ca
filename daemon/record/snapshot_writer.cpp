#include "record/snapshot_writer.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <google/protobuf/io/coded_stream.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "wire/encode.h"
#include "wire/json.h"

namespace mocap::record {
namespace {

// Written to the system in pieces of this size; what is lost with the process is less than this.
constexpr std::size_t kPiece_bytes = 64 * 1024;

enum class Form { JsonLines, Protobuf };

class SnapshotWriter final : public Writer {
 public:
  SnapshotWriter(std::string path, int file, Form form) : path_(std::move(path)), file_(file), form_(form) {
    waiting_.reserve(2 * kPiece_bytes);
  }
  SnapshotWriter(const SnapshotWriter&) = delete;
  SnapshotWriter& operator=(const SnapshotWriter&) = delete;
  ~SnapshotWriter() override {
    if (file_ < 0) return;
    if (!failure_) (void)flush();
    ::close(file_);
  }

  Status write(const Snapshot& snapshot) override {
    if (const Status open = check_open(); !open) return open;
    wire::encode(snapshot, message_);
    if (form_ == Form::JsonLines) {
      waiting_ += wire::to_json_line(message_);
      waiting_ += '\n';
    } else {
      append_delimited();
    }
    return waiting_.size() < kPiece_bytes ? Status{} : flush();
  }

  Status finish() override {
    if (const Status open = check_open(); !open) return open;
    if (const Status flushed = flush(); !flushed) return flushed;
    // A pipe or terminal has no disk to wait for (EINVAL).
    if (::fsync(file_) != 0 && errno != EINVAL && errno != EROFS) return fail("cannot be flushed to the disk");
    const int file = file_;
    file_ = -1;
    if (::close(file) != 0) return fail("cannot be closed");
    return {};
  }

 private:
  Status check_open() const {
    if (failure_) return *failure_;
    if (file_ < 0) return Error{ErrorCode::Io, fmt::format("recording '{}': is finished already", path_)};
    return {};
  }

  void append_delimited() {
    using google::protobuf::io::CodedOutputStream;
    const std::size_t size = message_.ByteSizeLong();
    std::uint8_t length[10];
    const std::uint8_t* end = CodedOutputStream::WriteVarint64ToArray(size, length);
    waiting_.append(reinterpret_cast<const char*>(length), static_cast<std::size_t>(end - length));
    const std::size_t start = waiting_.size();
    waiting_.resize(start + size);
    message_.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(waiting_.data() + start));
  }

  Status flush() {
    std::string_view rest = waiting_;
    while (!rest.empty()) {
      const ssize_t written = ::write(file_, rest.data(), rest.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return fail("cannot be written");
      rest.remove_prefix(static_cast<std::size_t>(written));
    }
    waiting_.clear();
    return {};
  }

  Status fail(const char* what) {
    failure_ = Error{ErrorCode::Io, fmt::format("recording '{}' {}: {}", path_, what, std::strerror(errno))};
    return *failure_;
  }

  std::string path_;
  int file_;
  Form form_;
  std::string waiting_;
  v1::Snapshot message_;
  std::optional<Error> failure_;
};

}  // namespace

Result<std::unique_ptr<Writer>> make_snapshot_writer(const std::filesystem::path& path) {
  const auto ending = path.extension();
  if (ending != ".jsonl" && ending != ".pb") {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("recording '{}': ends in '{}', expected .jsonl or .pb", path.string(), ending.string())};
  }
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) {
    return Error{ErrorCode::Io,
                 fmt::format("recording '{}' cannot be opened: {}", path.string(), std::strerror(errno))};
  }
  const Form form = ending == ".pb" ? Form::Protobuf : Form::JsonLines;
  return std::unique_ptr<Writer>(std::make_unique<SnapshotWriter>(path.string(), file, form));
}

}  // namespace mocap::record
