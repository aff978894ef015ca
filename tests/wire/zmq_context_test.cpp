#include "wire/zmq_context.h"

#include <gtest/gtest.h>
#include <zmq.h>

#include <string>
#include <string_view>

#include "raw_server.h"
#include "support/raw_tcp.h"
#include "wire/listener.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

namespace mocap::wire {
namespace zmq_context_test {

constexpr Duration kLong = std::chrono::seconds(60);  // time limit of a failing test

// More messages than a queue holds, with a PING (RFC 37, ZMTP 3.1) after each tenth. ZeroMQ answers a PING at once,
// also one that waited behind a full queue.
std::string flood(std::string_view message, int count) {
  std::string bytes;
  for (int i = 0; i < count; ++i) {
    bytes += '\0';
    bytes += static_cast<char>(message.size());
    bytes += message;
    if (i % 10 == 9) bytes += std::string_view("\4\7\4PING\0\0", 9);
  }
  return bytes;
}

// Without the guard in ZmqContext one of fifty such peers aborts the program inside libzmq.
TEST(ZmqContext, APeerThatFillsTheQueueAndResetsTheConnectionAbortsNothing) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  constexpr std::uint64_t kPeers = 50;
  for (std::uint64_t i = 0; i < kPeers; ++i) {
    support::RawTcp hostile((*publisher)->endpoint());
    hostile.subscribe_to_nothing_yet();
    hostile.send(flood("\1snapshot", 2500));
    hostile.reset();
  }

  const Timestamp begun = host_now();
  while ((*publisher)->feed().disconnections < kPeers && host_now() - begun < kLong) (*publisher)->serve();

  EXPECT_EQ((*publisher)->feed().disconnections, kPeers);
}

}  // namespace zmq_context_test
}  // namespace mocap::wire
