#include "trigger/udp_port.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <thread>

#include "base/wake_descriptor.h"
#include "trigger/request.h"

namespace mocap::trigger {
namespace udp_port_test {

using ::testing::HasSubstr;

constexpr Duration kPatience = std::chrono::seconds(60);

// A socket of another program on this machine.
class Other {
 public:
  Other() {
    sockaddr_in at = address(0);
    EXPECT_EQ(::bind(number_, reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
  }
  ~Other() { ::close(number_); }
  Other(const Other&) = delete;
  Other& operator=(const Other&) = delete;

  std::uint16_t port() const {
    sockaddr_in at{};
    socklen_t size = sizeof at;
    ::getsockname(number_, reinterpret_cast<sockaddr*>(&at), &size);
    return ntohs(at.sin_port);
  }
  void send(std::uint16_t to, const std::string& bytes) const {
    const sockaddr_in at = address(to);
    EXPECT_EQ(::sendto(number_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&at), sizeof at),
              static_cast<ssize_t>(bytes.size()));
  }
  std::string receive() const {
    std::string bytes(100, '\0');
    bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(0, ::recv(number_, bytes.data(), bytes.size(), 0))));
    return bytes;
  }

 private:
  static sockaddr_in address(std::uint16_t port) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    at.sin_port = htons(port);
    return at;
  }
  int number_ = ::socket(AF_INET, SOCK_DGRAM, 0);
};

// A port that was free a moment ago.
int free_port() { return Other().port(); }

TriggerSettings two_ports() {
  TriggerSettings settings;
  settings.listen = "127.0.0.1";
  settings.senders = {"127.0.0.1"};
  settings.xml_ports = {free_port()};
  settings.osc_ports = {free_port()};
  return settings;
}

TEST(UdpPort, IsTriedBeforeTheDaemonGivesUpItsOwn) {
  const Other other;
  TriggerSettings wanted;
  wanted.listen = "127.0.0.1";
  wanted.senders = {"127.0.0.1"};
  wanted.osc_ports = {other.port()};

  EXPECT_EQ(try_udp_ports(wanted, {}).error().code, ErrorCode::Busy);
  EXPECT_TRUE(try_udp_ports(wanted, wanted));
  TriggerSettings away = wanted;
  away.listen = "198.51.100.7";
  EXPECT_EQ(try_udp_ports(away, wanted).error().code, ErrorCode::NotFound);
}

TEST(UdpPort, ReceivesAndAnswersOnEachSocket) {
  const TriggerSettings settings = two_ports();
  auto port = open_udp_port(settings);
  ASSERT_TRUE(port) << port.error().message;
  const Other other;

  for (const auto& [number, socket] : {std::pair(settings.xml_ports[0], 0U), std::pair(settings.osc_ports[0], 1U)}) {
    other.send(static_cast<std::uint16_t>(number), "hello");
    const auto datagram = (*port)->next(-1, kPatience);
    ASSERT_TRUE(datagram);
    EXPECT_EQ(datagram->socket, socket);
    EXPECT_EQ(datagram->peer, (Peer{INADDR_LOOPBACK, other.port()}));
    EXPECT_EQ(datagram->bytes, "hello");
    EXPECT_FALSE(datagram->cut);

    (*port)->send({socket, datagram->peer, "good day"});
    EXPECT_EQ(other.receive(), "good day");
  }
}

TEST(UdpPort, CutsADatagramThatIsTooLarge) {
  const TriggerSettings settings = two_ports();
  auto port = open_udp_port(settings);
  ASSERT_TRUE(port);

  Other().send(static_cast<std::uint16_t>(settings.xml_ports[0]), std::string(kMaxPacket_bytes + 1, 'x'));
  const auto datagram = (*port)->next(-1, kPatience);

  ASSERT_TRUE(datagram);
  EXPECT_TRUE(datagram->cut);
  EXPECT_EQ(datagram->bytes.size(), kMaxPacket_bytes);
}

TEST(UdpPort, WakesWithoutADatagram) {
  auto port = open_udp_port(two_ports());
  ASSERT_TRUE(port);
  WakeDescriptor wake;
  const std::jthread thread([&] { wake.signal(); });

  EXPECT_FALSE((*port)->next(wake.number(), kPatience));
  EXPECT_FALSE((*port)->next(-1, std::chrono::milliseconds(1)));
}

TEST(UdpPort, SurvivesAReceiverThatIsNotThere) {
  const TriggerSettings settings = two_ports();
  auto port = open_udp_port(settings);
  ASSERT_TRUE(port);
  (*port)->send({0, {INADDR_LOOPBACK, static_cast<std::uint16_t>(free_port())}, "hello"});
  (*port)->send({0, {INADDR_BROADCAST, 9}, "hello"});

  const Other other;
  other.send(static_cast<std::uint16_t>(settings.xml_ports[0]), "hello");
  std::optional<Datagram> datagram;
  for (int tries = 0; tries < 10 && !datagram; ++tries) datagram = (*port)->next(-1, kPatience);

  EXPECT_TRUE(datagram);
}

TEST(UdpPort, NamesAPortThatIsTaken) {
  const Other other;
  TriggerSettings settings = two_ports();
  settings.xml_ports = {other.port()};

  const auto port = open_udp_port(settings);

  ASSERT_FALSE(port);
  EXPECT_EQ(port.error().code, ErrorCode::Busy);
  EXPECT_THAT(port.error().message, HasSubstr("[trigger] cannot listen on 127.0.0.1 UDP port"));
}

TEST(UdpPort, NamesAnAddressOfAnotherMachine) {
  TriggerSettings settings = two_ports();
  settings.listen = "192.0.2.1";

  const auto port = open_udp_port(settings);

  ASSERT_FALSE(port);
  EXPECT_EQ(port.error().code, ErrorCode::NotFound);
}

}  // namespace udp_port_test
}  // namespace mocap::trigger
