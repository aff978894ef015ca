// The reason why a client has no connection, with real sockets.
#include "wire/client_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <memory>
#include <string>
#include <thread>

#include "raw_server.h"
#include "support/temporary_folder.h"
#include "wire/curve_keys.h"
#include "wire/zmq_control.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_socket.h"
#include "wire/zmq_subscriber.h"

namespace mocap::wire {
namespace client_link_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Duration kLong = seconds(60);  // limit of a failing test

// A control server with keys that serves until destroyed; `anna` is allowed.
class GuardedControl {
 public:
  GuardedControl() {
    EXPECT_TRUE(save_key_pair(folder_.path() / "server.key", server));
    EXPECT_TRUE(save_allowed_keys(folder_.path() / "allowed.keys", {{anna.public_key, Role::Operator, "anna"}}));
    ControlSettings settings;
    settings.endpoint = "tcp://127.0.0.1:*";
    settings.curve = {folder_.path() / "server.key", folder_.path() / "allowed.keys"};
    auto opened = ZmqControl::open(settings);
    EXPECT_TRUE(opened) << opened.error().message;
    control_ = std::move(*opened);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) static_cast<void>(control_->next(milliseconds(5)));
    });
  }

  // The error of a request with these keys.
  Error ask(const ClientKeys& keys) const {
    const auto client = ControlClient::open({control_->endpoint(), keys});
    EXPECT_TRUE(client) << client.error().message;
    const Result<std::string> answer = (*client)->ask("", kLong);
    EXPECT_FALSE(answer);
    return answer ? Error{ErrorCode::Io, ""} : answer.error();
  }

  const std::string& endpoint() const { return control_->endpoint(); }

  KeyPair server = *new_key_pair();
  KeyPair anna = *new_key_pair();

 private:
  support::TemporaryFolder folder_;
  std::unique_ptr<ZmqControl> control_;
  std::jthread thread_;
};

TEST(ClientLink, SaysThatNothingListens) {
  std::string endpoint;
  {
    const auto gone = ZmqControl::open({.endpoint = "tcp://127.0.0.1:*"});
    ASSERT_TRUE(gone);
    endpoint = (*gone)->endpoint();
  }

  const auto client = ControlClient::open({endpoint, {}});
  ASSERT_TRUE(client);
  const Result<std::string> answer = (*client)->ask("", kLong);

  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(answer.error().message, HasSubstr("nothing listens at " + endpoint));
  EXPECT_THAT(answer.error().message, HasSubstr("[control] endpoint"));
}

TEST(ClientLink, DistinguishesTheFaultsOfKeys) {
  const GuardedControl control;
  const KeyPair stranger = *new_key_pair();

  EXPECT_THAT(control.ask({}).message, HasSubstr("requires a key"));
  EXPECT_THAT(control.ask({control.server.public_key, stranger}).message,
              HasSubstr("does not know the public key of this client"));
  EXPECT_THAT(control.ask({stranger.public_key, control.anna}).message,
              HasSubstr("does not have the server key of this client"));
}

TEST(ClientLink, SaysThatADaemonUsesNoKeys) {
  const auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher);
  SubscriberSettings settings;
  settings.endpoint = (*publisher)->endpoint();
  settings.keys = {new_key_pair()->public_key, *new_key_pair()};
  const auto subscriber = ZmqSubscriber::open(settings);
  ASSERT_TRUE(subscriber);

  const Timestamp limit = host_now() + kLong;
  while ((*subscriber)->link().fault == LinkFault::None && host_now() < limit) {
    static_cast<void>((*subscriber)->next(milliseconds(10)));
  }

  EXPECT_THAT(explain((*subscriber)->link().fault, settings.endpoint, {"[publish] endpoint"}),
              HasSubstr("uses no keys"));
}

// A program that closes each handshake before the client knows why, as a daemon on a busy machine does.
TEST(ClientLink, AsksForTheGreetingOfAPeerThatClosesFirst) {
  const auto closes_first = [](std::string_view mechanism) {
    return [greeting = zmtp_greeting(mechanism)](std::string_view received) -> std::optional<std::string> {
      if (received.empty()) return greeting.substr(0, 12);
      if (received.size() == 12) return greeting.substr(12);  // the question for the greeting has no more
      if (received.size() > 12) return std::nullopt;
      return "";
    };
  };
  const RawServer guarded(closes_first("CURVE")), open(closes_first("NULL"));
  const auto fault = [](const RawServer& server, const ClientKeys& keys) {
    const auto client = ControlClient::open({server.endpoint(), keys});
    EXPECT_TRUE(client) << client.error().message;
    return (*client)->ask("", kLong).error().message;
  };
  const ClientKeys keys{new_key_pair()->public_key, *new_key_pair()};

  EXPECT_THAT(fault(guarded, {}), HasSubstr(guarded.endpoint() + " requires a key: "));
  EXPECT_THAT(fault(guarded, keys), HasSubstr("does not have the server key of this client"));
  EXPECT_THAT(fault(open, {}), HasSubstr("is not a mocapd"));
  EXPECT_THAT(fault(open, keys), HasSubstr(open.endpoint() + " uses no keys"));
}

TEST(ClientLink, NamesTheFaultOfAConnectionThatWasRejectedBeforeTheRequest) {
  const GuardedControl control;
  const auto client = ControlClient::open({control.endpoint(), {control.server.public_key, *new_key_pair()}});
  ASSERT_TRUE(client);
  zmq_poll(nullptr, 0, 300);  // the daemon rejects the key meanwhile; a slower machine tests less

  const Result<std::string> answer = (*client)->ask("", kLong);

  ASSERT_FALSE(answer);
  EXPECT_THAT(answer.error().message, HasSubstr("does not know the public key of this client"));
}

TEST(ClientLink, LetsTheHandshakeOfANewSocketFinish) {
  const GuardedControl control;
  const ZmqContext context;
  ZmqSocket socket;
  ClientLink link;
  const auto connect = [&] {
    link.close();
    socket.close();
    ASSERT_TRUE(socket.open(context, ZMQ_DEALER, "test"));
    ASSERT_TRUE(socket.set(ZMQ_LINGER, 0));
    link.watch(context.get(), socket.get(), false);
    ASSERT_EQ(zmq_connect(socket.get(), control.endpoint().c_str()), 0);
  };
  connect();
  const Timestamp limit = host_now() + kLong;
  while (link.status().fault == LinkFault::None && host_now() < limit) {
    zmq_poll(nullptr, 0, 10);
    link.read();
  }
  ASSERT_TRUE(link.gave_up(host_now() + kLong));

  connect();

  // However long the new handshake takes, as on a slow network: the socket is not opened anew before it has failed.
  EXPECT_FALSE(link.gave_up(host_now() + kLong));
}

TEST(ClientKeys, AreReadFromFilesAndRefusedInHalves) {
  const support::TemporaryFolder folder;
  const KeyPair own = *new_key_pair(), server = *new_key_pair();
  const std::string own_file = (folder.path() / "own.key").string();
  const std::string server_file = (folder.path() / "server.key").string();
  ASSERT_TRUE(save_key_pair(own_file, own));
  ASSERT_TRUE(save_key_pair(server_file, server));

  const auto by_file = load_client_keys(server_file, own_file);
  const auto by_key = load_client_keys(server.public_key, own_file);

  ASSERT_TRUE(by_file) << by_file.error().message;
  ASSERT_TRUE(by_key) << by_key.error().message;
  EXPECT_EQ(by_file->server_key, server.public_key);
  EXPECT_EQ(by_key->server_key, server.public_key);
  EXPECT_EQ(by_file->own_key.secret_key, own.secret_key);
  EXPECT_FALSE(load_client_keys("", "")->on());
  EXPECT_THAT(load_client_keys(server_file, "").error().message, HasSubstr("go together"));
  EXPECT_THAT(load_client_keys("", own_file).error().message, HasSubstr("go together"));
  const auto public_only = folder.write("public.key", "public " + own.public_key + "\n");
  EXPECT_THAT(load_client_keys(server_file, public_only.string()).error().message, HasSubstr("no line 'secret KEY'"));
}

}  // namespace client_link_test
}  // namespace mocap::wire
