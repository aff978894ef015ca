#include "trigger/unlisted_senders.h"

#include <gtest/gtest.h>

namespace mocap::trigger {
namespace unlisted_senders_test {

using std::chrono::seconds;

TEST(UnlistedSenders, AreNamedAtOnceAndThenOnceAMinuteWithTheirCount) {
  UnlistedSenders senders;
  EXPECT_EQ(senders.note(0x0A000009, from_ns(0)), "refused a packet from 10.0.0.9, not in [trigger] senders");
  for (int i = 0; i < 56; ++i) EXPECT_FALSE(senders.note(0x0A000009, Timestamp(seconds(1))));

  EXPECT_EQ(senders.note(0x0A000009, Timestamp(seconds(61))),
            "refused 57 packets from 10.0.0.9, not in [trigger] senders");
}

TEST(UnlistedSenders, OfManyAddressesAreCountedTogether) {
  UnlistedSenders senders;
  int lines = 0;
  for (std::uint32_t address = 1; address <= 100'000; ++address) lines += senders.note(address, from_ns(0)) ? 1 : 0;

  EXPECT_EQ(lines, 65);
  EXPECT_EQ(senders.note(70'000, Timestamp(seconds(30))), std::nullopt);
}

}  // namespace unlisted_senders_test
}  // namespace mocap::trigger
