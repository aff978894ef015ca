#include "bridges/udp/udp_sender.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <string>
#include <string_view>
#include <vector>

#include "bridges/lib/descriptor.h"
#include "bridges/lib/udp_socket.h"

namespace mocap::bridge {
namespace udp_sender_test {

using ::testing::ElementsAre;

constexpr int kLong_ms = 30'000;  // a limit that a loaded machine meets

// Where localhost has the addresses ::1 and 127.0.0.1, the resolver names ::1 first.
TEST(UdpSender, ANameReachesAReceiverOfIpv4) {
  std::string fault;
  auto receiver = UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
  ASSERT_TRUE(receiver) << fault;
  const auto sender = UdpSender::open("localhost", std::to_string(receiver->bound().port), fault);
  ASSERT_NE(sender, nullptr) << fault;
  EXPECT_TRUE(sender->is_local());

  ASSERT_TRUE(sender->send("packet"));

  pollfd item{.fd = receiver->descriptor(), .events = POLLIN, .revents = 0};
  ASSERT_EQ(::poll(&item, 1, kLong_ms), 1);
  std::vector<std::string> received;
  receiver->receive([&](const Peer& /*from*/, std::string_view packet) { received.emplace_back(packet); });
  EXPECT_THAT(received, ElementsAre("packet"));
}

TEST(UdpSender, AnAddressOfIpv6ReachesItsReceiver) {
  const Descriptor receiver(::socket(AF_INET6, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in6 raw{};
  raw.sin6_family = AF_INET6;
  raw.sin6_addr = in6addr_loopback;
  socklen_t size = sizeof raw;
  auto* const generic = reinterpret_cast<sockaddr*>(&raw);
  if (!receiver || ::bind(receiver.number(), generic, size) != 0) GTEST_SKIP() << "this machine has no IPv6";
  ::getsockname(receiver.number(), generic, &size);
  std::string fault;
  const auto sender = UdpSender::open("::1", std::to_string(ntohs(raw.sin6_port)), fault);
  ASSERT_NE(sender, nullptr) << fault;

  ASSERT_TRUE(sender->send("packet"));

  pollfd item{.fd = receiver.number(), .events = POLLIN, .revents = 0};
  EXPECT_EQ(::poll(&item, 1, kLong_ms), 1);
}

}  // namespace udp_sender_test
}  // namespace mocap::bridge
