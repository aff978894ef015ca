// Preloaded into a program: calls on files below $MOCAP_FAILING_FOLDER fail as libfiu's points say, which fiu-ctrl
// turns on and off: files/open, files/read, files/write, files/short_write, files/sync, files/rename.
// $MOCAP_FAILING_SEED: of the chances.
//
// libfiu's own preload library cannot be used for that: it fails read and write of every descriptor. libzmq wakes its
// threads by an eventfd and stops the process if that fails.
#define FIU_ENABLE 1  // without it, fiu.h makes every point succeed

#include <dlfcn.h>
#include <fcntl.h>
#include <fiu-control.h>
#include <fiu.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace {

// The first is retried by careful code, the others are reported.
constexpr std::array kErrors{EINTR, EIO, ENOSPC, EDQUOT};
std::atomic<unsigned> failures{0};

const char* folder() {
  static const char* const value = std::getenv("MOCAP_FAILING_FOLDER");
  return value;
}

[[gnu::constructor]] void seed() {
  if (const char* text = std::getenv("MOCAP_FAILING_SEED")) fiu_set_prng_seed(static_cast<unsigned>(std::atoi(text)));
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

bool is_below(const char* path) { return folder() != nullptr && std::string_view(path).starts_with(folder()); }

bool is_below(int file) {
  if (folder() == nullptr || file <= STDERR_FILENO) return false;
  std::array<char, 64> link;
  std::array<char, 4096> path;
  std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", file);
  const ssize_t length = ::readlink(link.data(), path.data(), path.size() - 1);
  if (length <= 0) return false;
  path[static_cast<std::size_t>(length)] = '\0';
  return is_below(path.data());
}

// Sets errno if the call fails.
template <class Where>
bool fails(const char* point, Where where) {
  const int before = errno;
  const bool yes = fiu_fail(point) != 0 && is_below(where);
  errno = yes ? kErrors[failures++ % kErrors.size()] : before;
  return yes;
}

// Half of the bytes, as on a disk that becomes full.
size_t shortened(int file, size_t count) { return count > 1 && fails("files/short_write", file) ? count / 2 : count; }

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  if (fails("files/open", path)) return -1;
  static const auto real = next<int (*)(const char*, int, ...)>("open");
  return real(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  if (fails("files/open", path)) return -1;
  static const auto real = next<int (*)(const char*, int, ...)>("open64");
  return real(path, flags, mode);
}

FILE* fopen(const char* path, const char* mode) {
  if (fails("files/open", path)) return nullptr;
  static const auto real = next<FILE* (*)(const char*, const char*)>("fopen");
  return real(path, mode);
}

FILE* fopen64(const char* path, const char* mode) {
  if (fails("files/open", path)) return nullptr;
  static const auto real = next<FILE* (*)(const char*, const char*)>("fopen64");
  return real(path, mode);
}

ssize_t read(int file, void* to, size_t count) {
  if (fails("files/read", file)) return -1;
  static const auto real = next<ssize_t (*)(int, void*, size_t)>("read");
  return real(file, to, count);
}

ssize_t pread(int file, void* to, size_t count, off_t at) {
  if (fails("files/read", file)) return -1;
  static const auto real = next<ssize_t (*)(int, void*, size_t, off_t)>("pread");
  return real(file, to, count, at);
}

ssize_t write(int file, const void* from, size_t count) {
  if (fails("files/write", file)) return -1;
  static const auto real = next<ssize_t (*)(int, const void*, size_t)>("write");
  return real(file, from, shortened(file, count));
}

ssize_t pwrite(int file, const void* from, size_t count, off_t at) {
  if (fails("files/write", file)) return -1;
  static const auto real = next<ssize_t (*)(int, const void*, size_t, off_t)>("pwrite");
  return real(file, from, shortened(file, count), at);
}

int fsync(int file) {
  if (fails("files/sync", file)) return -1;
  static const auto real = next<int (*)(int)>("fsync");
  return real(file);
}

int fdatasync(int file) {
  if (fails("files/sync", file)) return -1;
  static const auto real = next<int (*)(int)>("fdatasync");
  return real(file);
}

int rename(const char* from, const char* to) {
  if (fails("files/rename", to)) return -1;
  static const auto real = next<int (*)(const char*, const char*)>("rename");
  return real(from, to);
}

}  // extern "C"
