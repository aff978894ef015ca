#pragma once

namespace mocap::support {

/// Whether a sanitizer watches the tests. Code with many allocations takes ten times as long then.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace mocap::support
