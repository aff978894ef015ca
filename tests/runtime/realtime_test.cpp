#include "runtime/process/realtime.h"

#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <barrier>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace mocap::runtime {
namespace realtime_test {

constexpr std::size_t kImage_bytes = 640 * 480;

// Counts the heaps in glibc's XML report.
std::size_t heaps() {
  char* text = nullptr;
  std::size_t length = 0;
  std::FILE* const file = open_memstream(&text, &length);
  malloc_info(0, file);
  std::fclose(file);
  const std::string report(text, length);
  std::free(text);
  std::size_t count = 0;
  for (std::size_t at = 0; (at = report.find("<heap nr", at)) != std::string::npos; ++at) ++count;
  return count;
}

// Allocates in `count` threads that all hold their memory at the same time.
void take_memory_in_threads(std::ptrdiff_t count) {
  std::barrier all_hold(count);
  std::vector<std::jthread> threads;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    threads.emplace_back([&all_hold] {
      const std::vector<std::string> held(100, std::string(500, 'x'));
      all_hold.arrive_and_wait();
    });
  }
}

std::size_t blocks_with_own_pages() { return mallinfo2().hblks; }

class OneHeap : public testing::Test {
 protected:
  void SetUp() override {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "the sanitizer brings an allocator of its own";
#endif
    use_one_heap();
  }
};

int niceness_of_this_thread() { return ::getpriority(PRIO_PROCESS, static_cast<id_t>(::gettid())); }

TEST(YieldToOtherThreads, LowersTheCallingThreadAloneAndThoseThatItStarts) {
  const int before = niceness_of_this_thread();
  if (before > 5) GTEST_SKIP() << "these tests run at niceness " << before << "; a thread cannot raise its priority";
  int lowered = -1;
  int child = -1;

  std::thread([&] {
    yield_to_other_threads(5);
    lowered = niceness_of_this_thread();
    std::thread([&] { child = niceness_of_this_thread(); }).join();
  }).join();

  EXPECT_EQ(lowered, 5);
  EXPECT_EQ(child, 5);
  EXPECT_EQ(niceness_of_this_thread(), before);
}

TEST_F(OneHeap, IsSharedByShortLivedThreads) {
  const std::size_t before = heaps();

  take_memory_in_threads(8);

  EXPECT_EQ(heaps(), before);
}

TEST_F(OneHeap, MapsImagesSeparatelyAlsoAfterOneWasFreed) {
  std::make_unique<std::byte[]>(kImage_bytes).reset();
  const std::size_t before = blocks_with_own_pages();

  const auto image = std::make_unique<std::byte[]>(kImage_bytes);

  EXPECT_EQ(blocks_with_own_pages(), before + 1);
}

}  // namespace realtime_test
}  // namespace mocap::runtime
