// Who may listen: CURVE with a list of allowed keys, and limits for those who mean harm.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>

#include "sample_description.h"
#include "support/temporary_folder.h"
#include "wire/curve_keys.h"
#include "wire/gatekeeper.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

namespace mocap::wire {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::sample_description;

constexpr Duration kLong = seconds(20);  // never waited for when all is well

// A feed with CURVE, a list of one viewer, and somebody who serves it.
class GuardedFeed {
 public:
  GuardedFeed() {
    server_ = *new_key_pair();
    anna_ = *new_key_pair();
    EXPECT_TRUE(save_key_pair(folder_.path() / "server.key", server_));
    allow({{anna_.public_key, Role::Viewer, "anna"}});
    auto opened = ZmqPublisher::open(
        {.endpoint = "tcp://127.0.0.1:*", .curve = {folder_.path() / "server.key", folder_.path() / "allowed.keys"}});
    EXPECT_TRUE(opened) << opened.error().message;
    publisher_ = std::move(*opened);
    EXPECT_TRUE(publisher_->describe(sample_description()));
    serve();
  }
  ~GuardedFeed() { rest(); }

  void serve() {
    thread_ = std::jthread([this](const std::stop_token& stop) {
      Snapshot snapshot;
      while (!stop.stop_requested()) {
        ++snapshot.number;
        EXPECT_TRUE(publisher_->publish(snapshot));
        std::this_thread::sleep_for(milliseconds(1));  // the pace of a feed, nothing is awaited
      }
    });
  }
  // The publisher is the caller's from then on.
  void rest() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
  }
  void allow(const std::vector<AllowedKey>& keys) {
    EXPECT_TRUE(save_allowed_keys(folder_.path() / "allowed.keys", keys));
  }
  std::unique_ptr<ZmqSubscriber> listener(const std::string& server_key, const KeyPair& own) {
    SubscriberSettings settings;
    settings.endpoint = publisher_->endpoint();
    settings.server_key = server_key;
    settings.own_key = own;
    return std::move(*ZmqSubscriber::open(settings));
  }
  FeedHealth figures() {
    rest();
    const FeedHealth figures = publisher_->feed();
    serve();
    return figures;
  }

  KeyPair server_, anna_;

 private:
  support::TemporaryFolder folder_;
  std::unique_ptr<ZmqPublisher> publisher_;
  std::jthread thread_;
};

// Nothing comes while somebody who may listen gets hundreds of messages.
void expect_silence(GuardedFeed& feed, ZmqSubscriber& stranger) {
  const auto anna = feed.listener(feed.server_.public_key, feed.anna_);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(anna->next(kLong));
  EXPECT_FALSE(stranger.next(milliseconds(1)));
  EXPECT_FALSE(stranger.link().connected);
}

TEST(GuardedFeed, GivesTheDescriptionFirstToWhoIsAllowed) {
  GuardedFeed feed;

  const auto anna = feed.listener(feed.server_.public_key, feed.anna_);
  const Result<FeedMessage> first = anna->next(kLong);

  ASSERT_TRUE(first);
  EXPECT_EQ(first->topic, "description");
}

TEST(GuardedFeed, GivesNothingToAKeyThatIsNotAllowed) {
  GuardedFeed feed;
  const auto stranger = feed.listener(feed.server_.public_key, *new_key_pair());

  expect_silence(feed, *stranger);

  EXPECT_GE(feed.figures().refused_clients, 1U);
}

TEST(GuardedFeed, GivesNothingToWhoTakesItForAnotherServer) {
  GuardedFeed feed;
  const auto lost = feed.listener(new_key_pair()->public_key, feed.anna_);

  expect_silence(feed, *lost);

  EXPECT_GE(feed.figures().failed_handshakes, 1U);
}

TEST(GuardedFeed, GivesNothingToWhoHasNoKey) {
  GuardedFeed feed;
  const auto open = feed.listener("", {});

  expect_silence(feed, *open);

  EXPECT_GE(feed.figures().failed_handshakes, 1U);
}

TEST(GuardedFeed, CutsAClientOffWhoseKeyIsRevokedAndKeepsTheOthers) {
  GuardedFeed feed;
  const KeyPair ben = *new_key_pair();
  feed.allow({{feed.anna_.public_key, Role::Viewer, "anna"}, {ben.public_key, Role::Viewer, "ben"}});
  const auto anna = feed.listener(feed.server_.public_key, feed.anna_);
  ASSERT_TRUE(anna->next(kLong));
  const auto benjamin = feed.listener(feed.server_.public_key, ben);
  ASSERT_TRUE(benjamin->next(kLong));

  feed.allow({{feed.anna_.public_key, Role::Viewer, "anna"}});
  const Timestamp begun = host_now();
  while (benjamin->link().connected && host_now() - begun < kLong) static_cast<void>(benjamin->next(milliseconds(5)));

  EXPECT_FALSE(benjamin->link().connected);
  while (benjamin->next(milliseconds(1))) {
  }
  expect_silence(feed, *benjamin);
  EXPECT_TRUE(anna->link().connected);
  EXPECT_GE(feed.figures().cut_off, 1U);
}

TEST(GuardedFeed, LetsAKeyInThatIsAllowedWhileItRuns) {
  GuardedFeed feed;
  const KeyPair ben = *new_key_pair();
  EXPECT_FALSE(feed.listener(feed.server_.public_key, ben)->next(milliseconds(50)));

  feed.allow({{ben.public_key, Role::Operator, "ben"}});

  // ZeroMQ does not try again by itself once it was told that its key is refused.
  EXPECT_TRUE(feed.listener(feed.server_.public_key, ben)->next(kLong));
}

TEST(GuardedFeed, MayListenWhereOtherMachinesReachIt) {
  support::TemporaryFolder folder;
  ASSERT_TRUE(save_key_pair(folder.path() / "server.key", *new_key_pair()));
  ASSERT_TRUE(save_allowed_keys(folder.path() / "allowed.keys", {}));
  const CurveSettings curve{folder.path() / "server.key", folder.path() / "allowed.keys"};

  EXPECT_FALSE(ZmqPublisher::open({.endpoint = "tcp://0.0.0.0:*"}));
  EXPECT_TRUE(ZmqPublisher::open({.endpoint = "tcp://0.0.0.0:*", .curve = curve}));
}

TEST(Publisher, ListensAtSeveralEndpointsAtOnce) {
  support::TemporaryFolder folder;
  const std::string path = "ipc://" + (folder.path() / "feed").string();
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*", .more_endpoints = {path}});
  ASSERT_TRUE(publisher) << publisher.error().message;
  ASSERT_TRUE((*publisher)->describe(sample_description()));

  for (const std::string& endpoint : (*publisher)->endpoints()) {
    SubscriberSettings settings;
    settings.endpoint = endpoint;
    const auto subscriber = std::move(*ZmqSubscriber::open(settings));
    Result<FeedMessage> first = subscriber->next(milliseconds(5));
    for (int i = 0; i < 1000 && !first; ++i) {
      (*publisher)->serve();
      first = subscriber->next(milliseconds(5));
    }
    EXPECT_TRUE(first) << endpoint;
  }
}

TEST(GuardedFeed, DoesNotListenWhereZeroMQWouldAskNobody) {
  support::TemporaryFolder folder;
  ASSERT_TRUE(save_key_pair(folder.path() / "server.key", *new_key_pair()));
  ASSERT_TRUE(save_allowed_keys(folder.path() / "allowed.keys", {}));
  const ZmqContext context;
  auto keeper = Gatekeeper::open(context, {folder.path() / "server.key", folder.path() / "allowed.keys"}, "feed");
  ASSERT_TRUE(keeper) << keeper.error().message;
  ZmqSocket socket;
  ASSERT_TRUE(socket.open(context, ZMQ_XPUB, "feed"));

  EXPECT_EQ((*keeper)->guard(socket, "").error().code, ErrorCode::InvalidArgument);
  EXPECT_TRUE((*keeper)->guard(socket));
}

TEST(CurveKeys, AreReadAsTheyWereWritten) {
  support::TemporaryFolder folder;
  const KeyPair pair = *new_key_pair();
  ASSERT_TRUE(save_key_pair(folder.path() / "a.key", pair));

  const Result<KeyPair> read = load_key_pair(folder.path() / "a.key");

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->public_key, pair.public_key);
  EXPECT_EQ(read->secret_key, pair.secret_key);
  EXPECT_EQ(std::filesystem::status(folder.path() / "a.key").permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
  EXPECT_EQ(save_key_pair(folder.path() / "a.key", pair).error().code, ErrorCode::Busy);
}

TEST(CurveKeys, AListMayHaveCommentsThoughKeysHaveThatCharacterToo) {
  support::TemporaryFolder folder;
  std::string key = new_key_pair()->public_key;
  key[1] = key[39] = '#';  // Z85 has it
  ASSERT_TRUE(is_key(key));
  std::ofstream(folder.path() / "list") << "# all of us\n\n" << key << " operator anna # the boss\n";

  const auto read = load_allowed_keys(folder.path() / "list");

  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 1U);
  EXPECT_EQ(read->front().public_key, key);
  EXPECT_EQ(read->front().role, Role::Operator);
  EXPECT_EQ(read->front().name, "anna");
}

TEST(CurveKeys, AListSaysWhichLineIsWrong) {
  support::TemporaryFolder folder;
  std::ofstream(folder.path() / "short") << "# fine\nabc viewer anna\n";
  std::ofstream(folder.path() / "role") << new_key_pair()->public_key << " king anna\n";

  EXPECT_THAT(load_allowed_keys(folder.path() / "short").error().message, HasSubstr("line 2: 'abc' is no key"));
  EXPECT_THAT(load_allowed_keys(folder.path() / "role").error().message, HasSubstr("role is 'king'"));
  EXPECT_EQ(load_allowed_keys(folder.path() / "nothere").error().code, ErrorCode::NotFound);
}

}  // namespace
}  // namespace mocap::wire
