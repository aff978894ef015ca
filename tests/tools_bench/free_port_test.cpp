#include "bench/bridges/free_port.h"

#include <gtest/gtest.h>

#include "bridges/lib/udp_socket.h"

namespace free_port_test {

TEST(FreePort, CanBeBound) {
  const auto port = mocap::bench::free_port();
  ASSERT_TRUE(port.has_value());

  std::string fault;
  EXPECT_TRUE(mocap::bridge::UdpSocket::open({INADDR_LOOPBACK, *port}, fault).has_value()) << fault;
}

}  // namespace free_port_test
