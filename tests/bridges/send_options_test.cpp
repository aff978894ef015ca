#include "bridges/udp/send_options.h"

#include <gtest/gtest.h>

namespace mocap::bridge {
namespace {

TEST(SendOptions, AReceiverMayNameItsPort) {
  EXPECT_EQ(read_target("10.0.0.9", "14043"), (Target{"10.0.0.9", "14043"}));
  EXPECT_EQ(read_target("unreal.studio:14044", "14043"), (Target{"unreal.studio", "14044"}));
}

TEST(SendOptions, TheColonsOfAnIpv6AddressAreNoPort) {
  EXPECT_EQ(read_target("::1", "14043"), (Target{"::1", "14043"}));
  EXPECT_EQ(read_target("[::1]", "14043"), (Target{"::1", "14043"}));
  EXPECT_EQ(read_target("[fe80::2]:9000", "14043"), (Target{"fe80::2", "9000"}));
}

TEST(SendOptions, RefusesWhatIsNoReceiver) {
  for (const char* text : {"", ":9000", "host:", "host:nine", "host:123456", "[::1", "[]:9000", "[::1]x", "[::1]:"}) {
    EXPECT_FALSE(read_target(text, "14043").has_value()) << text;
  }
}

}  // namespace
}  // namespace mocap::bridge
