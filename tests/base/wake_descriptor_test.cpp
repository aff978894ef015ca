#include "base/wake_descriptor.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <thread>

namespace mocap {
namespace wake_descriptor_test {

bool readable(const WakeDescriptor& wake, int patience_ms) {
  pollfd wanted{wake.number(), POLLIN, 0};
  return ::poll(&wanted, 1, patience_ms) == 1;
}

TEST(WakeDescriptor, IsReadableFromASignalUntilItIsCleared) {
  WakeDescriptor wake;
  EXPECT_FALSE(readable(wake, 0));

  wake.signal();
  wake.signal();
  EXPECT_TRUE(readable(wake, 0));

  wake.clear();
  EXPECT_FALSE(readable(wake, 0));
}

TEST(WakeDescriptor, WakesAThreadThatWaits) {
  WakeDescriptor wake;
  const std::jthread other([&] { wake.signal(); });

  EXPECT_TRUE(readable(wake, 60'000));
}

}  // namespace wake_descriptor_test
}  // namespace mocap
