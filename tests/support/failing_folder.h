#pragma once

namespace mocap::support {

/// While it lives, this thread reads one entry of a folder; the next read fails with EIO, as on a disk with errors.
/// Only for binaries that are linked with failing_folder.cpp.
class FailingFolder {
 public:
  FailingFolder();
  FailingFolder(const FailingFolder&) = delete;
  FailingFolder& operator=(const FailingFolder&) = delete;
  ~FailingFolder();
};

}  // namespace mocap::support
