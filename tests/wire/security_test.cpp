// CURVE authentication with a list of allowed keys.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <cstdlib>
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
namespace security_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::sample_description;

constexpr Duration kLong = seconds(20);  // time limit of a failing test

// A feed with CURVE whose list has one viewer, anna; a thread publishes snapshots.
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
        std::this_thread::sleep_for(milliseconds(1));  // the rate of the feed; the test does not wait here
      }
    });
  }
  // Stops the thread, so that the caller may use the publisher.
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
    settings.keys.server_key = server_key;
    settings.keys.own_key = own;
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

// Expects that `stranger` receives nothing while an allowed client receives 300 messages.
void expect_silence(GuardedFeed& feed, ZmqSubscriber& stranger) {
  const auto anna = feed.listener(feed.server_.public_key, feed.anna_);
  for (int i = 0; i < 300; ++i) ASSERT_TRUE(anna->next(kLong));
  EXPECT_FALSE(stranger.next(milliseconds(1)));
  EXPECT_FALSE(stranger.link().connected);
}

TEST(GuardedFeed, SendsTheDescriptionFirstToAnAllowedClient) {
  GuardedFeed feed;

  const auto anna = feed.listener(feed.server_.public_key, feed.anna_);
  const Result<FeedMessage> first = anna->next(kLong);

  ASSERT_TRUE(first);
  EXPECT_EQ(first->topic, "description");
}

TEST(GuardedFeed, SendsNothingToAKeyThatIsNotAllowed) {
  GuardedFeed feed;
  const auto stranger = feed.listener(feed.server_.public_key, *new_key_pair());

  expect_silence(feed, *stranger);

  EXPECT_GE(feed.figures().refused_clients, 1U);
}

TEST(GuardedFeed, SendsNothingToAClientWithAnotherServerKey) {
  GuardedFeed feed;
  const auto lost = feed.listener(new_key_pair()->public_key, feed.anna_);

  expect_silence(feed, *lost);

  EXPECT_GE(feed.figures().failed_handshakes, 1U);
}

TEST(GuardedFeed, SendsNothingToAClientWithoutAKey) {
  GuardedFeed feed;
  const auto open = feed.listener("", {});

  expect_silence(feed, *open);

  EXPECT_GE(feed.figures().failed_handshakes, 1U);
}

TEST(GuardedFeed, DisconnectsOnlyTheClientWhoseKeyIsRevoked) {
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

TEST(GuardedFeed, AcceptsAKeyThatIsAddedWhileRunning) {
  GuardedFeed feed;
  const KeyPair ben = *new_key_pair();
  EXPECT_FALSE(feed.listener(feed.server_.public_key, ben)->next(milliseconds(50)));

  feed.allow({{ben.public_key, Role::Operator, "ben"}});

  // A ZeroMQ client does not retry after its key was rejected, so a new client connects.
  EXPECT_TRUE(feed.listener(feed.server_.public_key, ben)->next(kLong));
}

TEST(GuardedFeed, MayListenAtARemoteEndpoint) {
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

TEST(GuardedFeed, RejectsAnEmptyZapDomain) {
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

TEST(CurveKeys, RoundTripThroughFiles) {
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

TEST(CurveKeys, WithASecretThatOthersCanReadAreRefused) {
  support::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "a.key";
  const KeyPair pair = *new_key_pair();
  ASSERT_TRUE(save_key_pair(file, pair));
  std::filesystem::permissions(file, std::filesystem::perms(0640));

  const Result<KeyPair> read = load_key_pair(file);

  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(read.error().message, AllOf(HasSubstr("mode 0640"), HasSubstr("chmod 600 '" + file.string() + "'")));
  EXPECT_EQ(*load_public_key(file), pair.public_key);
}

TEST(CurveKeys, OfTheServiceManagerMayHaveAnAccessListInTheBitsOfTheGroup) {
  support::TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "a.key";
  ASSERT_TRUE(save_key_pair(file, *new_key_pair()));
  ::setenv("CREDENTIALS_DIRECTORY", folder.path().c_str(), 1);

  std::filesystem::permissions(file, std::filesystem::perms(0440));
  EXPECT_TRUE(load_key_pair(file));
  std::filesystem::permissions(file, std::filesystem::perms(0444));
  EXPECT_FALSE(load_key_pair(file));

  ::unsetenv("CREDENTIALS_DIRECTORY");
}

TEST(CurveKeys, DistinguishCommentsFromKeysThatContainAHash) {
  support::TemporaryFolder folder;
  std::string key(40, 'a');  // not a random key: five characters of Z85 with # among them can exceed 32 bits
  key[1] = key[39] = '#';
  ASSERT_TRUE(is_key(key));
  std::ofstream(folder.path() / "list") << "# all of us\n\n" << key << " operator anna # the boss\n";

  const auto read = load_allowed_keys(folder.path() / "list");

  ASSERT_TRUE(read) << read.error().message;
  ASSERT_EQ(read->size(), 1U);
  EXPECT_EQ(read->front().public_key, key);
  EXPECT_EQ(read->front().role, Role::Operator);
  EXPECT_EQ(read->front().name, "anna");
}

TEST(CurveKeys, NameTheMalformedLineOfAList) {
  support::TemporaryFolder folder;
  std::ofstream(folder.path() / "short") << "# fine\nabc viewer anna\n";
  std::ofstream(folder.path() / "role") << new_key_pair()->public_key << " king anna\n";

  EXPECT_THAT(load_allowed_keys(folder.path() / "short").error().message, HasSubstr("line 2: 'abc' is not a key"));
  EXPECT_THAT(load_allowed_keys(folder.path() / "role").error().message, HasSubstr("role is 'king'"));
  EXPECT_EQ(load_allowed_keys(folder.path() / "nothere").error().code, ErrorCode::NotFound);
}

}  // namespace security_test
}  // namespace mocap::wire
