#pragma once

#include "base/result.h"
#include "runtime/runtime_settings.h"

namespace mocap::runtime {

/// Applies priority and CPU affinity to the calling thread. Fails with Unsupported if the system denies one of them;
/// the other is applied all the same. The message names the remedy.
Status apply_to_this_thread(const ThreadSettings& settings);

/// Gives the processor to every thread of default priority before the calling thread and the threads that it starts
/// (niceness, setpriority(2)); `niceness` is 0 to 19. Needs no privilege.
void yield_to_other_threads(int niceness) noexcept;

/// Locks all present and future memory of this process into RAM. Fails with Unsupported; the message names the remedy.
Status lock_memory();

/// Makes all threads share one heap, so that memory freed by short-lived threads returns to the system
/// (decisions/0006). Applies to the whole process; call before the first thread starts.
void use_one_heap() noexcept;

/// Sets the thread's name for top and gdb; at most 15 characters are used.
void name_this_thread(const char* name) noexcept;

}  // namespace mocap::runtime
