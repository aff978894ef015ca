#include "support/failing_folder.h"

#include <dirent.h>
#include <dlfcn.h>

#include <cerrno>

namespace {

thread_local bool fails = false;
thread_local bool has_read = false;

}  // namespace

// Replaces the function of the C library, which std::filesystem calls.
extern "C" dirent* readdir(DIR* folder) {
  using Read = dirent* (*)(DIR*);
  static const auto read = reinterpret_cast<Read>(::dlsym(RTLD_NEXT, "readdir"));  // NOLINT: a function of C
  if (fails && has_read) {
    errno = EIO;
    return nullptr;
  }
  dirent* entry = read(folder);
  if (entry != nullptr && entry->d_name[0] != '.') has_read = true;  // std::filesystem passes over "." and ".."
  return entry;
}

namespace mocap::support {

FailingFolder::FailingFolder() {
  fails = true;
  has_read = false;
}

FailingFolder::~FailingFolder() { fails = false; }

}  // namespace mocap::support
