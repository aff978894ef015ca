#pragma once

#include <cstdint>

namespace mocap::support {

/// Number of heap allocations in the daemon's threads (those named "mocap-..."). A program that links
/// allocation_counter.cpp counts them: the file replaces malloc and operator new. Does not work with a sanitizer.
struct AllocationCount {
  std::uint64_t by_new = 0;     ///< operator new in any daemon thread, by the daemon's code and C++ libraries
  std::uint64_t by_malloc = 0;  ///< malloc, calloc, realloc in camera and fusion threads; not in the publish thread,
                                ///< where libzmq allocates each message with malloc
};

/// Returns false if a sanitizer replaces the allocator; then nothing is counted.
bool allocations_can_be_counted() noexcept;

void start_counting_allocations() noexcept;
AllocationCount stop_counting_allocations() noexcept;

}  // namespace mocap::support
