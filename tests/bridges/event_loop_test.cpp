#include "bridges/lib/event_loop.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <ctime>
#include <semaphore>
#include <thread>

namespace mocap::bridge {
namespace event_loop_test {

// Whether SIGTERM waits for the program. Takes it.
bool is_pending() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  const timespec at_once{};
  return ::sigtimedwait(&ends, nullptr, &at_once) == SIGTERM;
}

TEST(EventLoop, GetsTheSignalAlthoughAThreadStartedBefore) {
  sigset_t before;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  block_end_signals();
  std::binary_semaphore done(0);
  std::jthread early([&] { done.acquire(); });
  EventLoop loop;

  loop.run(std::chrono::hours(1), [] { ::kill(::getpid(), SIGTERM); });
  done.release();

  EXPECT_FALSE(is_pending());
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

TEST(EventLoop, LeavesASecondSignalToTheProgram) {
  sigset_t before;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  EventLoop loop;
  loop.run(std::chrono::hours(1), [] { ::kill(::getpid(), SIGTERM); });

  ::kill(::getpid(), SIGTERM);

  EXPECT_TRUE(is_pending());
  sigset_t now;
  unblock_end_signals();
  pthread_sigmask(SIG_SETMASK, nullptr, &now);
  EXPECT_EQ(sigismember(&now, SIGTERM), 0);
  EXPECT_EQ(sigismember(&now, SIGINT), 0);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace event_loop_test
}  // namespace mocap::bridge
