#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

namespace mocap::ctl {

/// A file that appears under its name only when it is complete, and never replaces an existing one. Until then it has
/// no name, so that nothing is left of it if the program ends. On a file system without unnamed files (NFS, FAT) it is
/// a file NAME.PID-1.part (or -2, ...) in the same folder, which the destructor removes.
class NewFile {
 public:
  /// Fails with Io, and with InvalidArgument if the name exists; the message has the next free name.
  static Result<NewFile> create(std::filesystem::path path);

  /// As create() on a file system without unnamed files, for a `path` that does not exist. Fails with Io.
  static Result<NewFile> create_part(std::filesystem::path path);

  NewFile(NewFile&& other) noexcept;
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;
  NewFile& operator=(NewFile&&) = delete;
  ~NewFile();

  Status append(std::string_view bytes);

  /// Flushes the file to the disk and gives it its name. Fails as `create` does.
  Status finish();

 private:
  NewFile(std::filesystem::path path, std::filesystem::path part, int file);
  int give_name() const;
  Error failed(std::string_view what) const;

  std::filesystem::path path_, part_;  // part_: empty if the file has no name yet
  int file_ = -1;
};

}  // namespace mocap::ctl
