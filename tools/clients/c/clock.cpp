#include "clock.h"

#ifdef _WIN32
#include <windows.h>
#endif

#include <chrono>

namespace mocap::client {
namespace {

#ifdef _WIN32
// std::chrono::system_clock of MinGW advances in steps of up to 16 ms.
std::int64_t utc_ns() {
  constexpr std::int64_t kEpochs_100ns = 116'444'736'000'000'000;  // from 1601, where Windows begins, to 1970
  FILETIME time;
  ::GetSystemTimePreciseAsFileTime(&time);
  const std::uint64_t since_1601_100ns = std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime;
  return (static_cast<std::int64_t>(since_1601_100ns) - kEpochs_100ns) * 100;
}
#else
std::int64_t utc_ns() { return std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count(); }
#endif

}  // namespace

Now now() { return {std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count(), utc_ns()}; }

}  // namespace mocap::client
