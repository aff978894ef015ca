// The image stream of the simulator: times at which packets are sent.
#include "gvsp_stream.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <vector>

#include "base/time.h"

namespace mocap::sim {
namespace gvsp_stream_test {

using std::chrono::microseconds;

sockaddr_in loopback() {
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return name;
}

/// The receiver of the packets; the kernel stamps their arrival.
class Client {
 public:
  Client() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)), name_(loopback()) {
    const int yes = 1;
    setsockopt(socket_, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
    socklen_t length = sizeof name_;
    bind(socket_, reinterpret_cast<const sockaddr*>(&name_), sizeof name_);
    getsockname(socket_, reinterpret_cast<sockaddr*>(&name_), &length);
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  const sockaddr_in& name() const { return name_; }

  /// Arrival times of the packets that are queued, UTC.
  std::vector<Duration> arrivals() const {
    std::vector<Duration> all;
    std::array<std::byte, 2000> packet{};
    alignas(cmsghdr) std::array<std::byte, 128> more{};
    iovec place{packet.data(), packet.size()};
    msghdr message{};
    message.msg_iov = &place;
    message.msg_iovlen = 1;
    message.msg_control = more.data();
    for (;;) {
      message.msg_controllen = more.size();
      if (recvmsg(socket_, &message, 0) < 0) return all;
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(CMSG_FIRSTHDR(&message)), sizeof stamp);
      all.push_back(std::chrono::seconds(stamp.tv_sec) + std::chrono::nanoseconds(stamp.tv_nsec));
    }
  }

 private:
  int socket_;
  sockaddr_in name_;
};

TEST(GvspStream, SendsNoPacketBeforeItsTimeIfTheClientSetsADelay) {
  constexpr Duration kDelay = microseconds(120);
  constexpr std::size_t kPayload_bytes = 38 * 1364;  // 38 packets, plus a leader and a trailer
  GvspStream stream(0.0, 1);
  const Client client;
  ASSERT_TRUE(stream.open(loopback().sin_addr));
  ASSERT_EQ(stream.room(kPayload_bytes).size(), kPayload_bytes);
  const Duration begun_utc = host_now().time_since_epoch() + utc_minus_host();

  stream.send(ServedImage{.id = 1}, {}, {.to = client.name(), .packet_bytes = 1400, .packet_delay = kDelay});

  const std::vector<Duration> arrivals = client.arrivals();
  ASSERT_EQ(arrivals.size(), 40U);
  for (std::size_t i = 1; i < arrivals.size(); ++i) {
    // The leader is sent at once, the others one by one. The bound covers two reads of two clocks.
    const Duration due = begun_utc + static_cast<Duration::rep>(i - 1) * kDelay;
    EXPECT_GT(arrivals[i], due - microseconds(20)) << i;
  }
}

}  // namespace gvsp_stream_test
}  // namespace mocap::sim
