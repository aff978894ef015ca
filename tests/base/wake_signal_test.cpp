#include "base/wake_signal.h"

#include <gtest/gtest.h>

#include <thread>

namespace mocap {
namespace wake_signal_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(WakeSignal, DoesNotSleepIfSignalledAfterTheTicket) {
  WakeSignal wake;
  const auto ticket = wake.ticket();
  wake.signal();

  const Timestamp before = host_now();
  wake.wait(ticket, seconds(30));

  EXPECT_LT(host_now() - before, seconds(10));
}

TEST(WakeSignal, ReturnsWhenPatienceHasPassed) {
  WakeSignal wake;

  const Timestamp before = host_now();
  wake.wait(wake.ticket(), milliseconds(20));

  EXPECT_GE(host_now() - before, milliseconds(20));
}

TEST(WakeSignal, WakesASleepingThread) {
  WakeSignal wake;
  const auto ticket = wake.ticket();
  std::jthread other([&] { wake.signal(); });

  const Timestamp before = host_now();
  wake.wait(ticket, seconds(30));

  EXPECT_LT(host_now() - before, seconds(10));
}

}  // namespace wake_signal_test
}  // namespace mocap
