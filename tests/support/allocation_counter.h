#pragma once

#include <cstdint>

namespace mocap::support {

/// Counts what the daemon's own threads (those named "mocap-...") ask of the heap. Link allocation_counter.cpp into
/// the program: it replaces malloc and operator new. Not together with a sanitizer.
struct AllocationCount {
  std::uint64_t by_new = 0;     ///< operator new, any daemon thread: our code and the C++ libraries under it
  std::uint64_t by_malloc = 0;  ///< malloc, calloc, realloc in camera and fusion threads. The publish thread's are left
                                ///< out: libzmq takes the room of each message from malloc.
};

/// False where a sanitizer owns the heap: nothing is counted.
bool allocations_can_be_counted() noexcept;

void start_counting_allocations() noexcept;
AllocationCount stop_counting_allocations() noexcept;

}  // namespace mocap::support
