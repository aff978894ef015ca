#include "support/allocation_counter.h"

#include <pthread.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)

namespace mocap::support {
bool allocations_can_be_counted() noexcept { return false; }
void start_counting_allocations() noexcept {}
AllocationCount stop_counting_allocations() noexcept { return {}; }
}  // namespace mocap::support

#else

namespace {

std::atomic<bool> counting{false};
std::atomic<std::uint64_t> news{0};
std::atomic<std::uint64_t> mallocs{0};

enum class Thread : char { Unknown, Foreign, Publish, Loop };
thread_local Thread this_thread = Thread::Unknown;

Thread find_out() noexcept {
  char name[16] = {};
  pthread_getname_np(pthread_self(), name, sizeof name);
  if (std::strncmp(name, "mocap-", 6) != 0) return Thread::Foreign;
  return std::strcmp(name, "mocap-publish") == 0 ? Thread::Publish : Thread::Loop;
}

void count(bool by_new) noexcept {
  if (!counting.load(std::memory_order_relaxed)) return;
  if (this_thread == Thread::Unknown) this_thread = find_out();
  if (this_thread == Thread::Foreign) return;
  if (by_new) {
    news.fetch_add(1, std::memory_order_relaxed);
  } else if (this_thread == Thread::Loop) {
    mallocs.fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace

// glibc's names of the functions that are replaced below.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);

void* malloc(std::size_t size) {
  count(false);
  return __libc_malloc(size);
}
void* calloc(std::size_t items, std::size_t size) {
  count(false);
  return __libc_calloc(items, size);
}
void* realloc(void* old, std::size_t size) {
  count(false);
  return __libc_realloc(old, size);
}
}

void* operator new(std::size_t size) {
  count(true);
  if (void* memory = __libc_malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace mocap::support {

bool allocations_can_be_counted() noexcept { return true; }

void start_counting_allocations() noexcept {
  news = 0;
  mallocs = 0;
  counting = true;
}

AllocationCount stop_counting_allocations() noexcept {
  counting = false;
  return {news, mallocs};
}

}  // namespace mocap::support

#endif
