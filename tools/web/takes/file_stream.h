#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "web/http_message.h"
#include "web/worker.h"

namespace mocap::web {

/// An open file, closed by the destructor. It stays readable after its name was removed.
class OpenFile {
 public:
  /// Fails with NotFound or Io. A symbolic link is not followed.
  static Result<std::shared_ptr<OpenFile>> open(const std::filesystem::path& path);
  ~OpenFile();
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  std::uint64_t size() const { return size_; }
  /// At most `most` bytes from `offset`; empty at the end, and if the file cannot be read.
  std::string read(std::uint64_t offset, std::size_t most) const;

 private:
  OpenFile(int file, std::uint64_t size) : file_(file), size_(size) {}

  int file_;
  std::uint64_t size_;
};

/// The bytes of a file, read by a worker in pieces of 64 KiB. The worker lives as long as next() is called.
class FileStream : public ByteStream, public std::enable_shared_from_this<FileStream> {
 public:
  using RunHere = std::function<void(std::function<void()>)>;

  /// `open`: counts the streams that are open; a stream of the last session may outlive the worker.
  FileStream(std::shared_ptr<OpenFile> file, Worker& worker, RunHere run_here, std::shared_ptr<std::atomic<int>> open);
  ~FileStream() override { --*open_; }
  FileStream(const FileStream&) = delete;
  FileStream& operator=(const FileStream&) = delete;

  std::uint64_t size() const override { return file_->size(); }
  void next(std::function<void(std::string)> take) override;

 private:
  std::shared_ptr<OpenFile> file_;
  Worker& worker_;
  RunHere run_here_;
  std::shared_ptr<std::atomic<int>> open_;
  std::uint64_t offset_ = 0;
};

}  // namespace mocap::web
