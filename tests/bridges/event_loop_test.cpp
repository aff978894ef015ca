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

TEST(EventLoop, GetsTheSignalAlthoughAThreadStartedBefore) {
  sigset_t before;
  pthread_sigmask(SIG_SETMASK, nullptr, &before);
  block_end_signals();
  std::binary_semaphore done(0);
  std::jthread early([&] { done.acquire(); });
  EventLoop loop;

  loop.run(std::chrono::hours(1), [] { ::kill(::getpid(), SIGTERM); });
  done.release();

  // The signal stays pending; the loops of other tests must not get it.
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  const timespec at_once{};
  EXPECT_EQ(::sigtimedwait(&ends, nullptr, &at_once), SIGTERM);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

}  // namespace event_loop_test
}  // namespace mocap::bridge
