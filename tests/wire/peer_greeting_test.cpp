// What a program announces at the start of a connection, with real sockets.
#include "wire/peer_greeting.h"

#include <gtest/gtest.h>
#include <zmq.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "raw_server.h"
#include "wire/curve_keys.h"
#include "wire/zmq_control.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace peer_greeting_test {

using std::chrono::seconds;

constexpr Duration kLong = seconds(60);  // limit of a failing test

// The answer of the program at an endpoint; Unknown if it closes the connection before.
Greeting greeting_of(const std::string& endpoint) {
  const ZmqContext context;
  PeerGreeting greeting;
  greeting.ask(context.get(), endpoint);
  const Timestamp limit = host_now() + kLong;
  while (greeting.is_asking() && host_now() < limit) {
    if (const Greeting said = greeting.read(); said != Greeting::Unknown) return said;
    zmq_poll(nullptr, 0, 1);
  }
  EXPECT_FALSE(greeting.is_asking());
  return Greeting::Unknown;
}

TEST(PeerGreeting, NamesTheSecurityOfAZeroMqSocket) {
  const ZmqContext context;
  ZmqSocket open, guarded;
  ASSERT_TRUE(open.open(context, ZMQ_REP, "open"));
  ASSERT_TRUE(guarded.open(context, ZMQ_ROUTER, "guarded"));
  ASSERT_TRUE(guarded.set(ZMQ_CURVE_SERVER, 1));
  ASSERT_EQ(zmq_setsockopt(guarded.get(), ZMQ_CURVE_SECRETKEY, new_key_pair()->secret_key.c_str(), 41), 0);
  const auto endpoint_of = [](ZmqSocket& socket) {
    char endpoint[64];
    std::size_t length = sizeof(endpoint);
    EXPECT_EQ(zmq_bind(socket.get(), "tcp://127.0.0.1:*"), 0);
    EXPECT_EQ(zmq_getsockopt(socket.get(), ZMQ_LAST_ENDPOINT, endpoint, &length), 0);
    return std::string(endpoint);
  };

  EXPECT_EQ(greeting_of(endpoint_of(open)), Greeting::WithoutKeys);
  EXPECT_EQ(greeting_of(endpoint_of(guarded)), Greeting::WithKeys);
}

TEST(PeerGreeting, ReadsAGreetingInParts) {
  const RawServer server([sent = std::size_t{0}](std::string_view received) mutable -> std::optional<std::string> {
    if (received.empty()) return zmtp_greeting("CURVE").substr(0, sent = 1);
    return zmtp_greeting("CURVE").substr(std::exchange(sent, 32));
  });

  EXPECT_EQ(greeting_of(server.endpoint()), Greeting::WithKeys);
}

TEST(PeerGreeting, RecognisesOtherProtocols) {
  const auto says = [](std::string bytes) {
    return [bytes](std::string_view received) { return received.empty() ? bytes : std::string(); };
  };
  const RawServer http(says("HTTP/1.1 400 Bad Request\r\n\r\n")), old(says({"\xff\0\0\0\0\0\0\0\1\x7f\1\0", 12})),
      almost(says({"\xff\0\0\0\0\0\0\0\1\0\3\0", 12}));

  EXPECT_EQ(greeting_of(http.endpoint()), Greeting::NotZeroMq);
  EXPECT_EQ(greeting_of(old.endpoint()), Greeting::NotZeroMq);
  EXPECT_EQ(greeting_of(almost.endpoint()), Greeting::NotZeroMq);
}

TEST(PeerGreeting, EndsWithoutAnAnswer) {
  const RawServer closes([](std::string_view received) -> std::optional<std::string> {
    if (received.empty()) return zmtp_greeting("CURVE").substr(0, 31);
    return std::nullopt;
  });

  EXPECT_EQ(greeting_of(closes.endpoint()), Greeting::Unknown);
  EXPECT_EQ(greeting_of("ipc:///tmp/mocapd"), Greeting::Unknown);
  EXPECT_EQ(greeting_of("no endpoint"), Greeting::Unknown);
}

}  // namespace peer_greeting_test
}  // namespace mocap::wire
