#include "base/wake_signal.h"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>

namespace mocap {
namespace {

static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t), "the kernel reads the bare word");

long futex(std::atomic<std::uint32_t>* word, int operation, std::uint32_t value, const timespec* patience) noexcept {
  return syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(word), operation | FUTEX_PRIVATE_FLAG, value, patience,
                 nullptr, 0);
}

}  // namespace

void WakeSignal::signal() noexcept {
  // Sequentially consistent on both words: either we see the sleeper, or it sees the new count and does not sleep.
  count_.fetch_add(1, std::memory_order_seq_cst);
  if (sleepers_.load(std::memory_order_seq_cst) != 0) futex(&count_, FUTEX_WAKE, 1, nullptr);
}

void WakeSignal::wait(Ticket ticket, Duration patience) noexcept {
  if (patience <= Duration::zero()) return;
  const auto whole = std::chrono::duration_cast<std::chrono::seconds>(patience);
  const timespec limit{static_cast<time_t>(whole.count()), static_cast<long>((patience - whole).count())};
  sleepers_.fetch_add(1, std::memory_order_seq_cst);
  if (count_.load(std::memory_order_seq_cst) == ticket) futex(&count_, FUTEX_WAIT, ticket, &limit);
  sleepers_.fetch_sub(1, std::memory_order_seq_cst);
}

}  // namespace mocap
