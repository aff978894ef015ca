#include "runtime/process/realtime.h"

#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

namespace mocap::runtime {
namespace {

std::string refused_priority(int priority, int reason) {
  return fmt::format("SCHED_FIFO priority {} refused: {}; allow it with LimitRTPRIO={} in the unit, or ulimit -r",
                     priority, std::strerror(reason), priority);
}

std::string refused_cpus(const std::vector<int>& cpus, int reason) {
  return fmt::format("cpus [{}] refused: {}; use cpus that exist (see nproc) and are allowed", fmt::join(cpus, ", "),
                     std::strerror(reason));
}

}  // namespace

Status apply_to_this_thread(const ThreadSettings& settings) {
  std::string refused;
  if (settings.fifo_priority > 0) {
    sched_param parameters{};
    parameters.sched_priority = settings.fifo_priority;
    const int reason = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (reason != 0) refused = refused_priority(settings.fifo_priority, reason);
  }
  if (!settings.cpus.empty()) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (const int cpu : settings.cpus) {
      if (cpu >= 0 && cpu < CPU_SETSIZE) CPU_SET(static_cast<std::size_t>(cpu), &set);
    }
    const int reason = pthread_setaffinity_np(pthread_self(), sizeof set, &set);
    if (reason != 0) refused += (refused.empty() ? "" : "; ") + refused_cpus(settings.cpus, reason);
  }
  if (!refused.empty()) return Error{ErrorCode::Unsupported, refused};
  return {};
}

void yield_to_other_threads(int niceness) noexcept {
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), niceness));
}

Status lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return Error{ErrorCode::Unsupported,
               fmt::format("memory cannot be locked: {}; allow it with LimitMEMLOCK=infinity in the unit, or ulimit -l",
                           std::strerror(errno))};
}

// Aravis opens and closes each camera on new threads, and one thread frees memory that another thread allocated. With
// glibc's default of one heap for each thread, the heaps fragment and the process grows with each unplugged camera. The
// loops do not allocate, so the shared heap causes no waiting; glibc's per-thread cache of small blocks still works.
// The mmap threshold is glibc's default, made fixed: otherwise it rises to the size of an image when the first image is
// freed, and later images would be allocated in the fragmented heap.
void use_one_heap() noexcept {
  constexpr int kMmapThreshold_bytes = 128 * 1024;
  mallopt(M_ARENA_MAX, 1);
  mallopt(M_MMAP_THRESHOLD, kMmapThreshold_bytes);
}

void name_this_thread(const char* name) noexcept {
  char cut[16] = {};
  std::strncpy(cut, name, sizeof cut - 1);
  pthread_setname_np(pthread_self(), cut);
}

}  // namespace mocap::runtime
