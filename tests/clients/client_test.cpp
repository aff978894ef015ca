// Tests of the C library, without and with a connection.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "clients/messages.h"
#include "decode.h"
#include "feed.h"
#include "mocap_client.hpp"
#include "support/places.h"

namespace mocap::client {
namespace {

using ::testing::HasSubstr;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

Now at(double seconds) {
  const auto ns = static_cast<std::int64_t>(seconds * 1e9);
  return {ns, ns + testing::kUtcMinusHost_ns};
}

Feed feed_of(std::size_t keep = 1, int axes = MOCAP_AXES_MOCAP) {
  Feed feed({"tcp://127.0.0.1:5570", "snapshot", axes, keep, 1});
  feed.note({.connected = true, .since_ns = 0, .connections = 1});
  return feed;
}

// Feeds a description and `count` snapshots, one every 10 ms.
void fill(Feed& feed, int count) {
  feed.take(testing::description_message(), at(1.0));
  for (int i = 0; i < count; ++i) {
    const double when = 1.0 + 0.01 * (i + 1);
    feed.take(testing::snapshot_message(static_cast<std::uint64_t>(i), at(when).host_ns), at(when));
  }
}

TEST(ClientFeed, ReturnsTheNewestFrameAndCountsSkippedOnes) {
  Feed feed = feed_of();
  fill(feed, 5);
  Frame frame;

  EXPECT_TRUE(feed.hand_out(frame, at(1.1)));
  EXPECT_EQ(frame.info.sequence, 4U);
  EXPECT_FALSE(feed.hand_out(frame, at(1.1)));

  for (std::uint64_t i = 5; i < 8; ++i) feed.take(testing::snapshot_message(i, at(1.2).host_ns), at(1.2));
  EXPECT_TRUE(feed.hand_out(frame, at(1.2)));
  EXPECT_EQ(frame.info.sequence, 7U);
  EXPECT_EQ(feed.statistics(at(1.2)).skipped, 2U);
}

TEST(ClientFeed, ReturnsEachKeptFrameInOrder) {
  Feed feed = feed_of(4);
  fill(feed, 6);
  Frame frame;

  for (std::uint64_t expected = 2; expected < 6; ++expected) {  // of six, four were kept
    EXPECT_TRUE(feed.hand_out(frame, at(1.1)));
    EXPECT_EQ(frame.info.sequence, expected);
  }
  EXPECT_FALSE(feed.hand_out(frame, at(1.1)));
}

TEST(ClientFeed, ReturnsTheNewestFrameToEachReader) {
  Feed feed = feed_of();
  fill(feed, 1);
  Frame one;
  Frame other;

  EXPECT_TRUE(feed.hand_out(one, at(1.1)));
  EXPECT_TRUE(feed.hand_out(other, at(1.1)));
  EXPECT_EQ(one.serial, other.serial);
}

TEST(ClientFeed, CountsGapsInTheSequenceAsLostAndANewSessionAsARestart) {
  Feed feed = feed_of();
  fill(feed, 2);
  feed.take(testing::snapshot_message(5, at(1.1).host_ns), at(1.1));
  EXPECT_EQ(feed.statistics(at(1.1)).lost, 3U);

  feed.take(testing::description_message("mocap.v1", 1, "another session"), at(2.0));
  feed.take(testing::snapshot_message(0, at(2.1).host_ns), at(2.1));

  EXPECT_EQ(feed.statistics(at(2.1)).restarts, 1U);
  EXPECT_EQ(feed.statistics(at(2.1)).lost, 3U);
}

TEST(ClientFeed, WithholdsSnapshotsOfAnUnknownDescription) {
  Feed feed = feed_of();
  fill(feed, 1);
  Frame frame;
  ASSERT_TRUE(feed.hand_out(frame, at(1.1)));

  feed.take(testing::snapshot_message(1, at(1.2).host_ns, 2), at(1.2));
  EXPECT_FALSE(feed.hand_out(frame, at(1.2)));
  feed.take(testing::description_message("mocap.v1", 2), at(1.3));
  feed.take(testing::snapshot_message(2, at(1.3).host_ns, 2), at(1.3));

  EXPECT_TRUE(feed.hand_out(frame, at(1.3)));
  EXPECT_EQ(frame.description->version, 2U);
}

TEST(ClientFeed, ReportsTheAgeOfFrames) {
  Feed feed = feed_of();
  fill(feed, 1);
  Frame frame;
  ASSERT_TRUE(feed.hand_out(frame, at(1.015)));

  // Tolerance 1 ns: the test rounds seconds to nanoseconds.
  EXPECT_NEAR(static_cast<double>(feed.statistics(at(1.015)).age_ns), 5e6, 1.0);
  EXPECT_NEAR(static_cast<double>(age_of(frame, at(1.11))), 1e8, 1.0);
}

TEST(ClientFeed, ReportsAbsentTimesWithoutData) {
  const auto expect_absent = [](const mocap_statistics& statistics) {
    EXPECT_EQ(statistics.age_ns, MOCAP_ABSENT);
    EXPECT_EQ(statistics.age_p50_ns, MOCAP_ABSENT);
    EXPECT_EQ(statistics.age_p99_ns, MOCAP_ABSENT);
  };
  Feed feed = feed_of();
  expect_absent(feed.statistics(at(1.0)));

  // A snapshot that does not say when it was exposed.
  feed.take(testing::description_message(), at(1.0));
  feed.take(testing::pose_message({{"position", {0, 0, 1}}, {"rotation_xyzw", {0, 0, 0, 1}}}), at(1.1));
  Frame frame;
  ASSERT_TRUE(feed.hand_out(frame, at(1.2)));

  EXPECT_EQ(frame.info.exposed_at_ns, MOCAP_ABSENT);
  EXPECT_EQ(age_of(frame, at(1.2)), MOCAP_ABSENT);
  expect_absent(feed.statistics(at(1.2)));
}

TEST(ClientFeed, FillsOmittedLocalPoses) {
  Feed feed = feed_of();
  // Two bones: the parent is rotated by 90 degrees about z, the child by 180 degrees.
  const float s = std::sqrt(0.5F);
  feed.take(testing::two_bones_description(), at(1.0));
  feed.take(testing::two_bones_snapshot({0, 0, s, s, 0, 0, 1, 0}), at(1.01));
  Frame frame;
  ASSERT_TRUE(feed.hand_out(frame, at(1.02)));

  const mocap_bone_pose& root = frame.subjects[0].bones[0];
  const mocap_bone_pose& child = frame.subjects[0].bones[1];
  EXPECT_EQ(root.local_position.z, 1.0F);          // equals the world position
  EXPECT_FLOAT_EQ(child.local_position.x, 0.25F);  // the rest offset
  EXPECT_NEAR(child.local_rotation.z, s, 1e-6F);   // 180 - 90 degrees
  EXPECT_NEAR(child.local_rotation.w, s, 1e-6F);
}

TEST(ClientFeed, RejectsInconsistentMessagesAndContinues) {
  Feed feed = feed_of();
  fill(feed, 1);

  feed.take("no zero byte", at(1.1));
  feed.take(std::string("snapshot\0\xff\xff", 11), at(1.1));
  feed.take(testing::two_bones_snapshot({0, 0, 0, 1, 0, 0, 0, 1}), at(1.1));  // two bones; the description has one
  feed.take(testing::two_bones_snapshot({0, 0, 0, NAN, 0, 0, 0, 1}), at(1.1));
  feed.take(testing::pose_message({{"position", {0, 3e38, 0}}, {"rotation_xyzw", {0, 0, 0, 1}}}),
            at(1.1));  // infinite after conversion to cm
  feed.take(testing::two_bones_snapshot({0, 0, 0, 1, 0, 0, 0}), at(1.1));

  feed.take(testing::snapshot_message(1, MOCAP_ABSENT), at(1.1));

  EXPECT_EQ(feed.statistics(at(1.1)).unreadable, 7U);
  Frame frame;
  EXPECT_TRUE(feed.hand_out(frame, at(1.1)));
  EXPECT_EQ(frame.info.sequence, 0U);
}

TEST(ClientFeed, DiagnosesWhyNoFramesArrive) {
  Feed feed({"tcp://10.0.0.7:5570", "snapshot", 0, 1, 1});
  EXPECT_EQ(feed.diagnose(at(1)).code, MOCAP_CONNECTING);
  feed.note({.fault = wire::LinkFault::NothingListens});
  EXPECT_EQ(feed.diagnose(at(1)).code, MOCAP_NOTHING_LISTENS);
  using wire::LinkFault;
  for (const auto& [fault, why] : {std::pair{LinkFault::KeyMissing, MOCAP_KEY_MISSING},
                                   {LinkFault::KeyNotWanted, MOCAP_KEY_MISSING},
                                   {LinkFault::KeyRefused, MOCAP_KEY_REFUSED},
                                   {LinkFault::ServerKeyWrong, MOCAP_SERVER_KEY_WRONG},
                                   {LinkFault::NotADaemon, MOCAP_NOT_A_FEED},
                                   {LinkFault::ClosedByPeer, MOCAP_NOT_A_FEED}}) {
    feed.note({.fault = fault});
    EXPECT_EQ(feed.diagnose(at(1)).code, why);
    EXPECT_THAT(feed.diagnose(at(1)).sentence, HasSubstr("tcp://10.0.0.7:5570"));
  }
  feed.note({.connected = true, .since_ns = kSecond_ns, .connections = 1});
  EXPECT_EQ(feed.diagnose(at(2)).code, MOCAP_CONNECTING);
  EXPECT_EQ(feed.diagnose(at(3)).code, MOCAP_NO_DESCRIPTION);
  feed.take(testing::description_message("mocap.v9"), at(3));
  EXPECT_EQ(feed.diagnose(at(3)).code, MOCAP_VERSION_TOO_NEW);
  feed.take(testing::description_message(), at(3));
  EXPECT_EQ(feed.diagnose(at(3)).code, MOCAP_NO_SNAPSHOTS);
}

TEST(ClientFeed, DistinguishesClockSkewFromLateMessages) {
  Feed feed = feed_of();
  feed.take(testing::description_message(), at(1.0));
  const auto run = [&](double from_s, std::int64_t late_ns, int every) {
    for (int i = 0; i < 400; ++i) {
      const double when = from_s + 0.01 * i;
      const std::int64_t sent_ns = at(when).host_ns - (i % every == 0 ? late_ns : 0);
      feed.take(testing::snapshot_message(static_cast<std::uint64_t>(i), sent_ns), at(when));
    }
    return feed.diagnose(at(from_s + 4.0)).code;
  };

  EXPECT_EQ(run(2.0, 3 * kSecond_ns, 2), MOCAP_WELL);  // every second message is late
  EXPECT_EQ(run(10.0, 3 * kSecond_ns, 1), MOCAP_CLOCK_SKEW);
  EXPECT_EQ(run(20.0, -3 * kSecond_ns, 1), MOCAP_CLOCK_SKEW);
}

// Returns the unit vector of a direction in the table of proto/axes/README.md.
mocap_vec3 direction(const std::string& word, int axes) {
  const auto signs = [](const std::string& name) {
    return name == "forward" || name == "left" || name == "up" ? 1.0F : -1.0F;
  };
  const float sign = signs(word);
  const bool ahead = word == "forward" || word == "backward";
  const bool sideways = word == "left" || word == "right";
  switch (axes) {
    case MOCAP_AXES_UNITY:
      return ahead ? mocap_vec3{0, 0, sign} : sideways ? mocap_vec3{-sign, 0, 0} : mocap_vec3{0, sign, 0};
    case MOCAP_AXES_UNREAL:
      return ahead ? mocap_vec3{sign, 0, 0} : sideways ? mocap_vec3{0, -sign, 0} : mocap_vec3{0, 0, sign};
    case MOCAP_AXES_GODOT:
      return ahead ? mocap_vec3{0, 0, -sign} : sideways ? mocap_vec3{-sign, 0, 0} : mocap_vec3{0, sign, 0};
    case MOCAP_AXES_GLTF:
      return ahead ? mocap_vec3{0, 0, sign} : sideways ? mocap_vec3{sign, 0, 0} : mocap_vec3{0, sign, 0};
    default: return ahead ? mocap_vec3{sign, 0, 0} : sideways ? mocap_vec3{0, sign, 0} : mocap_vec3{0, 0, sign};
  }
}

// Rotates a vector by another formula than the library: v + 2 w (u x v) + 2 u x (u x v).
mocap_vec3 turned(mocap_quat q, mocap_vec3 v) {
  const auto cross = [](mocap_vec3 a, mocap_vec3 b) {
    return mocap_vec3{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
  };
  const mocap_vec3 u{q.x, q.y, q.z};
  const mocap_vec3 once = cross(u, v);
  const mocap_vec3 twice = cross(u, once);
  return {v.x + 2 * (q.w * once.x + twice.x), v.y + 2 * (q.w * once.y + twice.y), v.z + 2 * (q.w * once.z + twice.z)};
}

constexpr float kTolerance = 1e-5F;  // rotations have errors of 1e-7 in single precision; positions are exact

void expect_near(mocap_vec3 found, mocap_vec3 expected, const std::string& what) {
  EXPECT_NEAR(found.x, expected.x, kTolerance) << what;
  EXPECT_NEAR(found.y, expected.y, kTolerance) << what;
  EXPECT_NEAR(found.z, expected.z, kTolerance) << what;
}

mocap_vec3 vec3_of(const nlohmann::json& v) { return {v.at(0), v.at(1), v.at(2)}; }
mocap_quat quat_of(const nlohmann::json& q) { return {q.at(0), q.at(1), q.at(2), q.at(3)}; }

constexpr const char* kEngines[] = {"mocap", "unity", "unreal", "godot", "gltf"};

class AxisVectors : public ::testing::TestWithParam<std::filesystem::path> {
 protected:
  nlohmann::json read() const { return nlohmann::json::parse(std::ifstream(GetParam())); }
};

TEST_P(AxisVectors, AgreeWithTheirDirections) {
  const nlohmann::json vector = read();
  for (int axes = 0; axes < 5; ++axes) {
    const mocap_quat turn = quat_of(vector.at(kEngines[axes]).at("rotation_xyzw"));
    for (const auto& [from, to] : vector.at("turns").items()) {
      expect_near(turned(turn, direction(from, axes)), direction(to, axes), std::string(kEngines[axes]) + " " + from);
    }
  }
}

TEST_P(AxisVectors, AgreeWithTheClient) {
  const nlohmann::json vector = read();
  for (int axes = 0; axes < 5; ++axes) {
    Feed feed = feed_of(1, axes);
    feed.take(testing::description_message(), at(1.0));
    feed.take(testing::pose_message(vector.at("mocap")), at(1.01));
    Frame frame;
    ASSERT_TRUE(feed.hand_out(frame, at(1.02)));

    const mocap_bone_pose& pose = frame.subjects.at(0).bones.at(0);
    const nlohmann::json& expected = vector.at(kEngines[axes]);
    const mocap_quat turn = quat_of(expected.at("rotation_xyzw"));
    for (const auto& [place, rotation] :
         {std::pair(pose.position, pose.rotation), std::pair(pose.local_position, pose.local_rotation)}) {
      expect_near(place, vec3_of(expected.at("position")), kEngines[axes]);
      expect_near({rotation.x, rotation.y, rotation.z}, {turn.x, turn.y, turn.z}, kEngines[axes]);
      EXPECT_NEAR(rotation.w, turn.w, kTolerance);
    }
    if (!expected.contains("velocity")) continue;
    expect_near(pose.velocity, vec3_of(expected.at("velocity")), kEngines[axes]);
    expect_near(pose.spin, vec3_of(expected.at("spin")), kEngines[axes]);
  }
}

std::vector<std::filesystem::path> vectors() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(support::source_folder() + "/proto/axes")) {
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  }
  return files;
}

INSTANTIATE_TEST_SUITE_P(All, AxisVectors, ::testing::ValuesIn(vectors()),
                         [](const auto& test) { return test.param.stem().string(); });

// A socket that publishes arbitrary messages.
class Publisher {
 public:
  Publisher() {
    EXPECT_EQ(zmq_bind(socket_, "tcp://127.0.0.1:*"), 0);
    char bound[64] = {};
    std::size_t size = sizeof bound;
    zmq_getsockopt(socket_, ZMQ_LAST_ENDPOINT, bound, &size);
    endpoint_ = bound;
  }
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;
  ~Publisher() {
    const int none = 0;
    zmq_setsockopt(socket_, ZMQ_LINGER, &none, sizeof none);
    zmq_close(socket_);
    zmq_ctx_term(context_);
  }
  void send(const std::string& message) { zmq_send(socket_, message.data(), message.size(), 0); }
  const std::string& endpoint() const { return endpoint_; }

 private:
  void* context_ = zmq_ctx_new();
  void* socket_ = zmq_socket(context_, ZMQ_PUB);
  std::string endpoint_;
};

std::int64_t host_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

TEST(Client, CanBePolledByManyThreads) {
  Publisher publisher;
  const auto client = Client::open({.endpoint = publisher.endpoint()});
  ASSERT_TRUE(client);
  std::atomic<bool> stop = false;
  std::atomic<int> readers_done = 0;
  std::vector<std::jthread> readers;
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      ClientFrame frame;
      std::uint64_t last = 0;
      for (int got = 0; got < 50 && !stop;) {
        if (!client->wait(frame, 10)) continue;
        EXPECT_GT(frame.info().number, last);
        last = frame.info().number;
        EXPECT_EQ(frame.subject("actor")->bone_poses().size(), 1U);
        client->statistics();
        client->diagnose();
        ++got;
      }
      ++readers_done;
    });
  }
  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  for (std::uint64_t i = 0; readers_done < 4 && std::chrono::steady_clock::now() < limit; ++i) {
    if (i % 100 == 0) publisher.send(testing::description_message());
    publisher.send(testing::snapshot_message(i, host_ns()));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the rate of the feed; the test does not wait here
  }
  EXPECT_EQ(readers_done, 4);
  stop = true;
}

TEST(Client, CallsTheProgramAfterEachMessage) {
  Publisher publisher;
  std::atomic<int> calls = 0;
  const auto count = [](void* argument) { ++*static_cast<std::atomic<int>*>(argument); };
  const auto client =
      Client::open({.endpoint = publisher.endpoint(), .on_message = count, .on_message_argument = &calls});
  ASSERT_TRUE(client);

  const auto limit = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  for (std::uint64_t i = 0; calls < 3 && std::chrono::steady_clock::now() < limit; ++i) {
    publisher.send(testing::description_message());
    publisher.send(testing::snapshot_message(i, host_ns()));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // the rate of the feed; the test does not wait here
  }

  EXPECT_GE(calls, 3);
  ClientFrame frame;
  EXPECT_TRUE(client->poll(frame));
}

TEST(Client, NamesTheInvalidOption) {
  std::string fault;
  EXPECT_FALSE(Client::open({.endpoint = "nonsense"}, &fault));
  EXPECT_THAT(fault, HasSubstr("tcp://ADDRESS:PORT"));
  EXPECT_FALSE(Client::open({.axes = 7}, &fault));
  EXPECT_THAT(fault, HasSubstr("axes is 7"));
  EXPECT_FALSE(Client::open({.keep = 0}, &fault));
  EXPECT_THAT(fault, HasSubstr("keep is 0"));
  EXPECT_FALSE(Client::open({.server_key = "short"}, &fault));
  EXPECT_THAT(fault, HasSubstr("server_key is neither a key"));
}

TEST(Client, AcceptsNullAndEmptyArguments) {
  mocap_client_close(nullptr);
  mocap_frame_free(nullptr);
  EXPECT_LT(mocap_client_poll(nullptr, nullptr), 0);
  const ClientFrame frame;
  EXPECT_EQ(frame.info().exposed_at_ns, MOCAP_ABSENT);
  EXPECT_FALSE(frame.age_ns());
  EXPECT_TRUE(frame.subjects().empty());
  EXPECT_EQ(mocap_frame_find_subject(frame.raw(), "actor"), -1);
  EXPECT_STREQ(mocap_frame_bone_text(frame.raw(), 3, 9, 0), "");
}

TEST(Client, FillsOnlyMembersThatTheCallerKnows) {
  struct Older {
    mocap_frame_info info;
    std::uint64_t after = 42;
  } older;
  mocap_frame* frame = mocap_frame_new();
  mocap_frame_get_info(frame, &older.info, sizeof(std::uint64_t));
  mocap_frame_free(frame);

  EXPECT_EQ(older.after, 42U);
}

std::vector<std::uint8_t> bytes_of(const std::string& hex) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(hex.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

TEST(ClientLite, DecodesTheVectorsOfTheProtocol) {
  for (const char* name : {"person", "prop", "lost"}) {
    std::ifstream file(support::source_folder() + "/proto/lite/" + name + ".json");
    const nlohmann::json vector = nlohmann::json::parse(file);
    const std::vector<std::uint8_t> bytes = bytes_of(vector["hex"]);
    mocap_lite lite{};

    ASSERT_EQ(mocap_lite_decode(bytes.data(), bytes.size(), MOCAP_AXES_MOCAP, &lite, sizeof(lite)), 1) << name;

    EXPECT_EQ(lite.number, vector["number"]);
    EXPECT_EQ(lite.sequence, vector["sequence"]);
    EXPECT_EQ(lite.exposed_at_utc_ns, vector["exposed_at_utc_ns"]);
    EXPECT_EQ(lite.description_version, vector["description_version"]);
    EXPECT_EQ(lite.phase, vector["phase"]);
    EXPECT_EQ(lite.subject_bones, vector["subject_bones"]);
    EXPECT_EQ(lite.first_bone, vector["first_bone"]);
    EXPECT_EQ(lite.out_of_range != 0, vector["out_of_range"]);
    EXPECT_EQ(lite.off_rest != 0, vector["off_rest"]);
    EXPECT_NEAR(lite.root_position.x, vector["root_m"][0].get<double>(), 1e-4);
    EXPECT_NEAR(lite.root_position.z, vector["root_m"][2].get<double>(), 1e-4);
    ASSERT_EQ(lite.bone_count, vector["sent_rotations_xyzw"].size());
    for (std::size_t i = 0; i < lite.bone_count; ++i) {
      const nlohmann::json& sent = vector["sent_rotations_xyzw"][i];
      ASSERT_EQ(lite.lost[i] != 0, sent.is_null()) << name << " bone " << i;
      if (sent.is_null()) continue;
      const mocap_quat& q = lite.rotations[i];
      const double inner = q.x * sent[0].get<double>() + q.y * sent[1].get<double>() + q.z * sent[2].get<double>() +
                           q.w * sent[3].get<double>();
      EXPECT_GT(std::abs(inner), 1.0 - 1e-6) << name << " bone " << i;
    }
  }
}

TEST(ClientLite, ConvertsToTheAxesOfAnEngine) {
  std::ifstream file(support::source_folder() + "/proto/lite/person.json");
  const std::vector<std::uint8_t> bytes = bytes_of(nlohmann::json::parse(file)["hex"]);
  mocap_lite lite{};

  ASSERT_EQ(mocap_lite_decode(bytes.data(), bytes.size(), MOCAP_AXES_UNREAL, &lite, sizeof(lite)), 1);

  EXPECT_NEAR(lite.root_position.x, 123.46F, 1e-3F);  // forward, right, up, cm
  EXPECT_NEAR(lite.root_position.y, 50.0F, 1e-3F);
  EXPECT_NEAR(lite.root_position.z, 98.7F, 1e-3F);
  EXPECT_EQ(lite.rotations[1].x, -1.0F);  // half a turn about forward: a reflection reverses its sense
}

TEST(ClientLite, RefusesWhatIsNoMessage) {
  mocap_lite lite{};
  const std::string text = "no message";

  EXPECT_EQ(mocap_lite_decode(text.data(), text.size(), MOCAP_AXES_MOCAP, &lite, sizeof(lite)), 0);
  EXPECT_LT(mocap_lite_decode(nullptr, 0, MOCAP_AXES_MOCAP, &lite, sizeof(lite)), 0);
  EXPECT_LT(mocap_lite_decode(text.data(), text.size(), 99, &lite, sizeof(lite)), 0);
  EXPECT_LT(mocap_lite_decode(text.data(), text.size(), MOCAP_AXES_MOCAP, nullptr, sizeof(lite)), 0);
}

}  // namespace
}  // namespace mocap::client
