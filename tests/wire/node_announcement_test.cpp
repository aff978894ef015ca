// tests/system/nodes_test.py announces nodes by a real Avahi.
#include "wire/discovery/node_announcement.h"

#include <gtest/gtest.h>

namespace mocap::wire {
namespace node_announcement_test {

TEST(NodeAnnouncement, NamesThePortThatOtherMachinesReach) {
  EXPECT_EQ(port_for_others({"tcp://127.0.0.1:5575", "ipc:///run/node", "tcp://10.0.0.5:5577"}), 5577);
  EXPECT_EQ(port_for_others({"tcp://0.0.0.0:5575"}), 5575);
  EXPECT_EQ(port_for_others({"tcp://[fe80::1]:5576"}), 5576);
}

TEST(NodeAnnouncement, NamesNoPortWhereOnlyThisMachineConnects) {
  EXPECT_EQ(port_for_others({"tcp://127.0.0.1:5575", "tcp://[::1]:5575", "ipc:///run/node"}), 0);
  EXPECT_EQ(port_for_others({}), 0);
}

}  // namespace node_announcement_test
}  // namespace mocap::wire
