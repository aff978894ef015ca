#pragma once

#include "base/result.h"
#include "runtime/runtime_settings.h"

namespace mocap::runtime {

/// Applies the settings to the calling thread. Fails with what the system refused and how to allow it; what could be
/// done is done all the same.
Status apply_to_this_thread(const ThreadSettings& settings);

/// Keeps all memory of this process, now and later, out of swap.
Status lock_memory();

/// What threads that come and go have freed goes back to the system, instead of staying behind in heaps of their own.
/// For the whole process; before its first thread.
void use_one_heap() noexcept;

/// The name that shows in top and gdb; at most 15 characters are kept.
void name_this_thread(const char* name) noexcept;

}  // namespace mocap::runtime
