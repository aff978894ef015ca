// Tests of mocap-relay without a server.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <thread>

#include "bridges/relay/nats_link.h"
#include "bridges/relay/newest.h"
#include "bridges/relay/server.h"
#include "bridges/relay/topics.h"
#include "support/loopback_listener.h"
#include "support/temporary_folder.h"
#include "wire/codec/lite.h"

namespace mocap::relay {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

TEST(RelayTopics, BecomeSubjects) {
  EXPECT_EQ(subject_of("studio", "description"), "mocap.studio.description");
  EXPECT_EQ(subject_of("a.b", "lite/anna"), "mocap.a.b.lite.anna");
  EXPECT_EQ(subject_of("studio", "subject/Anna-2_x"), "mocap.studio.subject.Anna-2_x");
}

TEST(RelayTopics, EscapeWhatHasAMeaningInSubjects) {
  EXPECT_EQ(subject_of("studio", "lite/a.b c*>%/\xC3\xA4"), "mocap.studio.lite.a%2Eb%20c%2A%3E%25%2F%C3%A4");
}

TEST(RelayTopics, AreThoseOfTheFeed) {
  for (const char* topic : {"lite/*", "lite/anna", "subject/*", "preview/north", "snapshot", "health", "event"}) {
    EXPECT_TRUE(is_topic(topic)) << topic;
  }
  for (const char* topic : {"", "lite", "lite/", "*", "snapshots", "control"}) EXPECT_FALSE(is_topic(topic)) << topic;
}

TEST(RelayTopics, APrefixIsPartOfASubject) {
  for (const char* prefix : {"studio", "a.b-c_3"}) EXPECT_TRUE(is_subject_prefix(prefix)) << prefix;
  for (const char* prefix : {"", ".", "a.", ".a", "a..b", "a b", "a*", ">"}) {
    EXPECT_FALSE(is_subject_prefix(prefix)) << prefix;
  }
}

TEST(RelayServer, HasTlsBeyondThisMachine) {
  EXPECT_EQ(read_server("nats.example.org"), (Server{"nats.example.org", "4222", true}));
  EXPECT_EQ(read_server("10.0.0.9:4333"), (Server{"10.0.0.9", "4333", true}));
  EXPECT_EQ(read_server("127.0.0.1"), (Server{"127.0.0.1", "4222", false}));
  EXPECT_EQ(read_server("tls://localhost"), (Server{"localhost", "4222", true}));
  EXPECT_EQ(read_server("nats://10.0.0.9"), (Server{"10.0.0.9", "4222", false}));
  EXPECT_EQ(read_server("tls://[::1]:1"), (Server{"[::1]", "1", true}));
  EXPECT_EQ(read_server("[2001:db8::1]")->url(), "tls://[2001:db8::1]:4222");
}

TEST(RelayServer, RefusesWhatIsNoServer) {
  for (const char* text :
       {"", "tls://", "host:", "host:x", "a:b:c", "http://host", "user:p@host", "nats://u@host", "a,b"}) {
    EXPECT_FALSE(read_server(text)) << text;
  }
}

class RelayCredentials : public ::testing::Test {
 protected:
  Result<Credentials> read(const std::string& text, fs::perms mode = fs::perms::owner_read) {
    const fs::path path = folder_.path() / "secret";
    fs::remove(path);
    std::ofstream(path) << text;
    fs::permissions(path, mode);
    return read_credentials(path);
  }

  support::TemporaryFolder folder_;
};

TEST_F(RelayCredentials, AreAUserATokenOrAFileOfNats) {
  EXPECT_EQ(read("anna:pa:ss\n")->user, "anna");
  EXPECT_EQ(read("anna:pa:ss\n")->password, "pa:ss");
  EXPECT_EQ(read("t0ken")->token, "t0ken");
  EXPECT_EQ(read("-----BEGIN NATS USER JWT-----\nx\n")->jwt, folder_.path() / "secret");
}

TEST_F(RelayCredentials, OfAFileThatOthersMayReadAreRefused) {
  const auto refused = read("anna:pass", fs::perms::owner_read | fs::perms::group_read);

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("0440"));
}

TEST_F(RelayCredentials, OfAnotherContentAreRefused) {
  for (const char* text : {"", "\n", "two words", "a:b\nc:d"}) EXPECT_FALSE(read(text)) << text;
  EXPECT_EQ(read_credentials(folder_.path() / "none").error().code, ErrorCode::NotFound);
}

std::string lite_payload(int first_bone) {
  wire::Lite lite;
  lite.subject_bones = 100;
  lite.first_bone = static_cast<std::uint8_t>(first_bone);
  std::array<std::uint8_t, wire::kMaxLite_bytes> bytes{};
  const std::size_t size = encode_lite(lite, bytes);
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

TEST(RelayNewest, KeepsTheNewestOfEachTopicAndCountsTheOthers) {
  Newest newest;
  newest.put({"snapshot", "1"}, 1);
  newest.put({"health", "2"}, 2);
  newest.put({"snapshot", "3"}, 3);

  const auto first = newest.take(0);
  const auto second = newest.take(0);

  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->payload, "3");
  EXPECT_EQ(first->arrived_ns, 3);
  EXPECT_EQ(second->payload, "2");
  EXPECT_FALSE(newest.take(0));
  EXPECT_EQ(newest.dropped(), 1U);
}

TEST(RelayNewest, TheDescriptionIsFirstAndNeverADrop) {
  Newest newest;
  newest.put({"snapshot", "1"}, 1);
  newest.put({"description", "2"}, 2);
  newest.put({"description", "3"}, 3);

  const auto first = newest.take(0);

  ASSERT_TRUE(first);
  EXPECT_EQ(first->payload, "3");
  EXPECT_EQ(newest.dropped(), 0U);
}

TEST(RelayNewest, KeepsEachPartOfASubject) {
  Newest newest;
  for (const int first_bone : {0, 27, 0, 27, 54}) newest.put({"lite/anna", lite_payload(first_bone)}, 1);

  EXPECT_EQ(newest.dropped(), 2U);
  for (const int first_bone : {0, 27, 54}) EXPECT_EQ(newest.take(0)->payload, lite_payload(first_bone));
}

TEST(RelayNewest, DropsWhatHasWaitedTooLong) {
  Newest newest;
  newest.put({"description", "0"}, 0);
  newest.put({"snapshot", "1"}, 1);
  newest.put({"markers", "2"}, 2);

  EXPECT_EQ(newest.take(2)->topic, "description");
  EXPECT_EQ(newest.take(2)->topic, "markers");
  EXPECT_EQ(newest.dropped(), 1U);
}

TEST(RelayNewest, IsBounded) {
  Newest newest;
  for (std::size_t i = 0; i < Newest::kMaxWaiting + 10; ++i) newest.put({"lite/" + std::to_string(i), ""}, 1);

  EXPECT_EQ(newest.dropped(), 10U);
}

TEST(NatsLink, SaysThatNothingListens) {
  // Port 1 of this machine is free: it needs root, and no service uses it.
  const auto link = NatsLink::open({.server = {"127.0.0.1", "1", false}, .ca = {}, .credentials = {}});
  ASSERT_TRUE(link);

  while ((*link)->state().reason.empty()) std::this_thread::yield();

  EXPECT_THAT((*link)->state().reason, HasSubstr("no NATS server answers at nats://127.0.0.1:1: start it"));
  EXPECT_FALSE((*link)->ready());
  EXPECT_FALSE((*link)->publish("mocap.studio.description", ""));
}

// A NATS server that takes one connection and refuses many messages at once.
class RefusingServer {
 public:
  static constexpr int kRefusals = 20'000;

  RefusingServer() : thread_([this] { serve(); }) {}
  RefusingServer(const RefusingServer&) = delete;
  RefusingServer& operator=(const RefusingServer&) = delete;
  ~RefusingServer() { thread_.join(); }
  std::string port() const { return std::to_string(listener_.port()); }

 private:
  void serve() const {
    const int client = listener_.accept();
    const auto send = [&](std::string_view text) { ::send(client, text.data(), text.size(), MSG_NOSIGNAL); };
    send("INFO {\"server_id\":\"test\",\"version\":\"2.9.0\",\"proto\":1,\"max_payload\":1048576}\r\n");
    std::string heard;
    char block[1024];
    while (heard.find("PING\r\n") == std::string::npos) {
      const ssize_t count = ::recv(client, block, sizeof block, 0);
      if (count <= 0) break;
      heard.append(block, static_cast<std::size_t>(count));
    }
    send("PONG\r\n");
    std::string refusals;
    for (int i = 0; i < kRefusals; ++i) refusals += "-ERR 'Permissions Violation for Publish to \"mocap.x\"'\r\n";
    send(refusals);
    while (::recv(client, block, sizeof block, 0) > 0) {
    }
    ::close(client);
  }

  support::LoopbackListener listener_;
  std::thread thread_;
};

// A sanitizer sees a callback that uses the link afterwards.
TEST(NatsLink, EndsAfterTheCallbacksThatWait) {
  RefusingServer server;
  auto link = NatsLink::open({.server = {"127.0.0.1", server.port(), false}, .ca = {}, .credentials = {}});
  ASSERT_TRUE(link);

  while ((*link)->state().reason.find("does not permit") == std::string::npos) std::this_thread::yield();
  link->reset();
}

TEST(NatsLink, RefusesAFileThatHasNoCertificates) {
  support::TemporaryFolder folder;
  std::ofstream(folder.path() / "ca.pem") << "nothing";

  const auto link =
      NatsLink::open({.server = {"localhost", "1", true}, .ca = folder.path() / "ca.pem", .credentials = {}});

  ASSERT_FALSE(link);
  EXPECT_THAT(link.error().message, HasSubstr("cannot be read as certificates"));
}

}  // namespace
}  // namespace mocap::relay
