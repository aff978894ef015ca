#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mocap::bridge {

/// The folder of the status files of bridges that are services or were started by root.
std::filesystem::path status_folder_of_services();
/// The folder of the status files of bridges that the user started; empty if the user's session has no runtime folder.
std::filesystem::path status_folder_of_user();

/// The status file of a bridge, which `mocapctl bridge list` reads. One thread.
class StatusFile {
 public:
  /// `path`: the option --status-file. Empty: status.json in $RUNTIME_DIRECTORY if systemd gave one, otherwise
  /// PROGRAM-PID.json in a folder of its own in $XDG_RUNTIME_DIR, or of root in /run. Without such a folder nothing is
  /// written: a folder that everybody may write to is not safe.
  StatusFile(std::string_view program, const std::string& path);
  /// Removes the file, unless the path was given.
  ~StatusFile();
  StatusFile(const StatusFile&) = delete;
  StatusFile& operator=(const StatusFile&) = delete;

  /// Replaces the content at once, so that a reader never sees half a file. Every user may read it. Does nothing if the
  /// folder cannot be written.
  void write(std::string_view json);

 private:
  std::filesystem::path path_;
  bool given_;
};

}  // namespace mocap::bridge
