#include "bridges/lib/udp_socket.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <poll.h>

#include <string>
#include <string_view>
#include <vector>

namespace mocap::bridge {
namespace udp_socket_test {

using ::testing::ElementsAre;

constexpr int kLong_ms = 30'000;  // a limit that a loaded machine meets

UdpSocket open_socket() {
  std::string fault;
  auto socket = UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
  EXPECT_TRUE(socket) << fault;
  return *std::move(socket);
}

bool has_events(const UdpSocket& socket, int timeout_ms) {
  pollfd item{.fd = socket.descriptor(), .events = POLLIN, .revents = 0};
  return ::poll(&item, 1, timeout_ms) == 1;
}

void ignore(const Peer& /*from*/, std::string_view /*packet*/) {}

// A socket with the report that the port `closed` is closed.
struct Reported {
  UdpSocket socket = open_socket();
  Peer closed = open_socket().bound();

  Reported() {
    EXPECT_EQ(socket.send(closed, "frame"), Sent::Done);
    EXPECT_TRUE(has_events(socket, kLong_ms));
  }
};

std::vector<std::uint32_t> own_addresses() {
  std::vector<std::uint32_t> own;
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return own;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    own.push_back(ntohl(reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr.s_addr));
  }
  ::freeifaddrs(all);
  return own;
}

TEST(HasRoute, FromLoopbackOnlyToThisMachine) {
  EXPECT_TRUE(has_route(INADDR_LOOPBACK, INADDR_LOOPBACK));
  for (const std::uint32_t own : own_addresses()) EXPECT_TRUE(has_route(INADDR_LOOPBACK, own)) << to_string({own, 0});
  EXPECT_FALSE(has_route(INADDR_LOOPBACK, *read_address("198.51.100.7")));  // of no machine, RFC 5737
}

TEST(UdpSocket, NamesAReceiverWhosePortIsClosed) {
  Reported reported;
  std::vector<Peer> found;

  reported.socket.receive(ignore, [&](const Peer& peer) { found.push_back(peer); });

  EXPECT_THAT(found, ElementsAre(reported.closed));
}

TEST(UdpSocket, HasNoEventsAfterReceivingAlsoIfNobodyWantsTheClosedPorts) {
  Reported reported;

  reported.socket.receive(ignore);

  EXPECT_FALSE(has_events(reported.socket, 0));
}

TEST(UdpSocket, ReceivesAfterMoreReportsThanItsBufferHolds) {
  Reported reported;
  for (int i = 0; i < 2000; ++i) {  // each uses at least 256 of 213 kB
    reported.socket.send(reported.closed, "frame");
    reported.socket.receive(ignore);
  }
  std::vector<std::string> received;

  ASSERT_EQ(open_socket().send(reported.socket.bound(), "request"), Sent::Done);
  ASSERT_TRUE(has_events(reported.socket, kLong_ms));
  reported.socket.receive([&](const Peer& /*from*/, std::string_view packet) { received.emplace_back(packet); });

  EXPECT_THAT(received, ElementsAre("request"));
}

}  // namespace udp_socket_test
}  // namespace mocap::bridge
