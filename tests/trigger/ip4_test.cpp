#include "trigger/ip4.h"

#include <gtest/gtest.h>

namespace mocap::trigger {
namespace ip4_test {

TEST(Ip4, ReadsAddressesInDottedDecimalNotationOnly) {
  EXPECT_EQ(read_address("10.0.0.7"), 0x0A000007U);
  EXPECT_EQ(read_address("255.255.255.255"), 0xFFFFFFFFU);
  for (const char* wrong : {"", "10.0.0", "10.0.0.256", "10.0.0.7 ", "localhost", "::1", "0x0a000007"}) {
    EXPECT_FALSE(read_address(wrong)) << wrong;
  }
  EXPECT_FALSE(read_address(std::string_view("10.0.0.7\0x", 10)));
}

TEST(Ip4, ReadsAnAddressWithItsPort) {
  EXPECT_EQ(read_peer("127.0.0.1:1510"), (Peer{0x7F000001, 1510}));
  for (const char* wrong : {"127.0.0.1", "127.0.0.1:", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:15x", ":1510",
                            "host:1510", "127.0.0.1:+1"}) {
    EXPECT_FALSE(read_peer(wrong)) << wrong;
  }
}

TEST(Ip4, WritesWhatItReads) { EXPECT_EQ(address_text(*read_address("192.168.1.20")), "192.168.1.20"); }

}  // namespace ip4_test
}  // namespace mocap::trigger
