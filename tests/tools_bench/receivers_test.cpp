#include "bench/bridges/receivers.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <thread>

#include "bench/bridges/frame_number.h"

namespace receivers_test {

using namespace mocap;         // NOLINT: the class under test
using namespace mocap::bench;  // NOLINT: the class under test

constexpr auto kLimit = std::chrono::seconds(60);

bridge::UdpSocket open_socket() {
  std::string fault;
  auto socket = bridge::UdpSocket::open({INADDR_LOOPBACK, 0}, fault);
  EXPECT_TRUE(socket.has_value()) << fault;
  return *std::move(socket);
}

template <class Condition>
bool wait_for(Condition condition) {
  const auto limit = std::chrono::steady_clock::now() + kLimit;
  while (!condition() && std::chrono::steady_clock::now() < limit) std::this_thread::yield();
  return condition();
}

TEST(Receivers, EachNotesItsFrames) {
  auto receivers = Receivers::open(2);
  ASSERT_TRUE(receivers.has_value());
  Arrivals arrivals(2, 10);
  std::atomic<std::size_t> joined{0};
  {
    const std::jthread serving(
        [&](const std::stop_token& stop) { receivers->run(stop, join_silently, reference_number, arrivals, joined); });
    const bridge::UdpSocket bridge = open_socket();
    std::string packet(8, '\0');
    packet[0] = 7;  // little endian
    for (const std::uint16_t port : receivers->ports()) bridge.send({INADDR_LOOPBACK, port}, packet);
    ASSERT_TRUE(wait_for([&] { return joined == 2U; }));
  }

  EXPECT_NE(arrivals.at_ns(0, 7), 0);
  EXPECT_NE(arrivals.at_ns(1, 7), 0);
  EXPECT_EQ(arrivals.at_ns(1, 8), 0);
}

TEST(Receivers, ANatNetClientAsksUntilItHasAFrame) {
  auto receivers = Receivers::open(1);
  ASSERT_TRUE(receivers.has_value());
  Arrivals arrivals(1, 10);
  std::atomic<std::size_t> joined{0};
  bridge::UdpSocket server = open_socket();
  const std::uint16_t port = server.bound().port;
  const std::jthread serving([&](const std::stop_token& stop) {
    receivers->run(
        stop, [port] { return join_natnet(port); }, natnet_number, arrivals, joined);
  });

  bool described = false;
  const bool done = wait_for([&] {
    server.receive([&](const bridge::Peer& from, std::string_view packet) {
      if (packet[0] == 0) server.send(from, std::string("\1\0\0\0", 4));          // SERVERINFO
      if (packet[0] == 4) server.send(from, std::string("\7\0\4\0\5\0\0\0", 8));  // frame 5
      described |= packet[0] == 4;
    });
    return joined == 1U;
  });

  EXPECT_TRUE(done);
  EXPECT_TRUE(described);
}

}  // namespace receivers_test
