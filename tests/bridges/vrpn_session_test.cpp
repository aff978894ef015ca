#include "bridges/vrpn/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>

#include "bridges/frames.h"
#include "support/places.h"

namespace mocap::vrpn {
namespace {

using bridge::testing::axis_vectors;
using bridge::testing::feed_pose;
using bridge::testing::TestFrame;
using bridge::testing::TestSubject;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const client::Axes kAxes(MOCAP_AXES_MOCAP);
constexpr std::int64_t kNow_ns = 1'700'000'006'500'000'000;

// A message that a client received.
struct Received {
  std::int32_t sender;
  std::int32_t type;
  std::string payload;
};

std::vector<Received> split(const std::string& bytes) {
  MessageReader reader;
  reader.append(bytes);
  std::vector<Received> found;
  while (const auto next = reader.next()) found.push_back({next->sender, next->type, std::string(next->payload)});
  EXPECT_FALSE(reader.broken());
  return found;
}

double double_at(const std::string& bytes, std::size_t start) {
  std::uint64_t bits = 0;
  for (const char byte : bytes.substr(start, 8)) bits = bits << 8U | static_cast<unsigned char>(byte);
  return std::bit_cast<double>(bits);
}

const TestSubject kActor{.name = "actor",
                         .bones = {{"Hips", "Hips", -1}, {"Chest", "Chest", 0}},
                         .poses = {{0, 0, 1, 0, 0, 0, 1}, {0, 0, 1.25, 0, 0, 0, 1}}};
const TestSubject kSword{.name = "sword", .bones = {{"Body", "", -1}}, .poses = {{1, 0, 1, 0, 0, 0, 1}}};

// A client of a feed with an actor and a sword.
class VrpnSession : public ::testing::Test {
 protected:
  VrpnSession() { senders.add(frame.get()); }

  void greet() {
    EXPECT_TRUE(session.take("vrpn: ver. 07.35  0" + std::string(5, '\0'), kNow_ns));
    session.output().clear();
  }
  void describe_sender(std::int32_t number, const std::string& name) {
    EXPECT_TRUE(session.take(message({}, number, kSenderDescription, describe_name(name)), kNow_ns));
  }
  void describe_type(std::int32_t number, std::string_view name) {
    EXPECT_TRUE(session.take(message({}, number, kTypeDescription, describe_name(name)), kNow_ns));
  }
  // Sender and type of each message to the client.
  std::vector<std::pair<std::int32_t, std::int32_t>> reports() {
    session.send(senders.report(frame.get(), kAxes, kNow_ns));
    std::vector<std::pair<std::int32_t, std::int32_t>> found;
    for (const Received& one : split(std::exchange(session.output(), {}))) found.emplace_back(one.sender, one.type);
    return found;
  }

  TestFrame frame{{kActor, kSword}};
  Senders senders;
  Session session{senders};
};

TEST_F(VrpnSession, OffersTheSubjectEachBoneAndEachProp) {
  EXPECT_THAT(senders.names(), ElementsAre("actor", "actor/Hips", "actor/Chest", "sword"));
}

TEST_F(VrpnSession, DescribesTypesAndSendersAfterTheCookie) {
  EXPECT_EQ(session.output(), cookie());
  session.output().clear();

  EXPECT_TRUE(session.take("vrpn: ver. 07.35 ", kNow_ns));
  EXPECT_EQ(session.output(), "");
  EXPECT_TRUE(session.take(" 0" + std::string(5, '\0'), kNow_ns));

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 8U);
  EXPECT_EQ(found[0].type, kTypeDescription);
  EXPECT_EQ(found[0].sender, 0);
  EXPECT_EQ(found[0].payload, describe_name("vrpn_Tracker Pos_Quat"));
  EXPECT_EQ(found[5].type, kSenderDescription);
  EXPECT_EQ(found[5].sender, 1);
  EXPECT_EQ(found[5].payload, describe_name("actor/Hips"));
}

TEST_F(VrpnSession, RefusesAnotherProtocol) {
  EXPECT_FALSE(session.take("GET / HTTP/1.1\r\nHost: localhost\r\n", kNow_ns));
  EXPECT_THAT(session.fault(), HasSubstr("vrpn: ver. 07."));
}

TEST_F(VrpnSession, SendsBonesAndPropsToAClientThatDescribesNoSender) {
  greet();

  EXPECT_THAT(reports(), ElementsAre(std::pair(1, 0), std::pair(2, 0), std::pair(3, 0)));
}

TEST_F(VrpnSession, SendsTheSendersThatTheClientDescribes) {
  greet();
  describe_sender(0, "VRPN Control");  // of the library itself
  EXPECT_EQ(reports().size(), 3U);
  describe_sender(5, "actor");
  describe_sender(6, "sword");

  session.send(senders.report(frame.get(), kAxes, kNow_ns));

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].sender, 0);
  EXPECT_EQ(found[1].payload, pose_payload(1, {0, 0, 1.25F}, {0, 0, 0, 1}));  // the second bone is sensor 1
  EXPECT_EQ(found[2].sender, 3);
}

TEST_F(VrpnSession, SendsASenderThatIsOfferedAfterTheClientDescribedIt) {
  greet();
  describe_sender(1, "late");
  describe_sender(2, "sword");
  EXPECT_THAT(reports(), ElementsAre(std::pair(3, 0)));
  TestSubject late = kSword;
  late.name = "late";
  const TestFrame next({late});

  EXPECT_TRUE(senders.add(next.get()));
  session.describe(kNow_ns);
  session.send(senders.report(next.get(), kAxes, kNow_ns));

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].payload, describe_name("late"));
  EXPECT_EQ(found[1].sender, 4);
}

TEST_F(VrpnSession, HasNoReportOfLostBonesAndOfSubjectsThatAreNotTracked) {
  TestSubject half = kActor;
  half.lost = {1};
  TestSubject gone = kSword;
  gone.poses.clear();
  const TestFrame next({half, gone});
  ASSERT_TRUE(next.filled());
  greet();

  session.send(senders.report(next.get(), kAxes, kNow_ns));

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].sender, 1);
}

TEST_F(VrpnSession, SendsVelocitiesIfTheFeedHasThem) {
  TestSubject moving = kSword;
  moving.velocities = {1, 2, 3};
  moving.spins = {0, 0, 4};
  const TestFrame next({kActor, moving});
  greet();

  session.send(senders.report(next.get(), kAxes, kNow_ns));

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 4U);  // the actor has none
  EXPECT_EQ(found[3].type, static_cast<std::int32_t>(Type::Velocity));
  EXPECT_EQ(found[3].payload, velocity_payload(0, {1, 2, 3}, {0, 0, 4}));
}

TEST_F(VrpnSession, AnswersPingsWithItsOwnNumbers) {
  greet();
  describe_sender(40, "actor/Hips");
  describe_type(17, "vrpn_Base ping_message");

  EXPECT_TRUE(session.take(message({}, 40, 17, ""), kNow_ns));
  EXPECT_TRUE(session.take(message({}, 41, 17, ""), kNow_ns));  // a sender that was not described
  EXPECT_TRUE(session.take(message({}, 40, 18, ""), kNow_ns));  // a type that was not described

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].sender, 1);
  EXPECT_EQ(found[0].type, static_cast<std::int32_t>(Type::Pong));
}

TEST_F(VrpnSession, SendsReportsByUdpInDatagramsBelowTheMtu) {
  TestSubject large{.name = "large", .bones = {}, .poses = {}};
  for (int i = 0; i < 40; ++i) {
    large.bones.push_back({"b" + std::to_string(i), "", i - 1});
    large.poses.push_back({0, 0, 1, 0, 0, 0, 1});
  }
  const TestFrame next({large});
  ASSERT_TRUE(senders.add(next.get()));
  greet();
  EXPECT_TRUE(session.take(message({}, 41234, kUdpDescription, std::string("127.0.0.1\0", 10)), kNow_ns));

  session.send(senders.report(next.get(), kAxes, kNow_ns));

  EXPECT_EQ(session.udp_port(), 41234);
  EXPECT_EQ(session.output(), "");
  std::size_t count = 0;
  for (const std::string& datagram : session.datagrams()) {
    EXPECT_LE(datagram.size(), kMaxDatagram_bytes);
    count += split(datagram).size();
  }
  EXPECT_EQ(count, 40U);
}

TEST_F(VrpnSession, DropsFramesForAClientThatDoesNotRead) {
  greet();
  const auto found = senders.report(frame.get(), kAxes, kNow_ns);

  for (int i = 0; i < 5000; ++i) session.send(found);

  EXPECT_GT(session.dropped(), 0U);
  EXPECT_LT(session.output().size(), Session::kMaxPending_bytes + 1000);
}

TEST_F(VrpnSession, ClosesAfterDisconnectOrInvalidMessages) {
  greet();

  EXPECT_FALSE(session.take(message({}, 0, kDisconnect, ""), kNow_ns));
  EXPECT_THAT(session.fault(), HasSubstr("disconnected"));
  Session other(senders);
  EXPECT_TRUE(other.take(cookie(), kNow_ns));
  EXPECT_FALSE(other.take(message({}, 70000, kUdpDescription, ""), kNow_ns));
  Session third(senders);
  EXPECT_TRUE(third.take(cookie(), kNow_ns));
  EXPECT_FALSE(third.take(std::string(24, '\0'), kNow_ns));
  EXPECT_THAT(third.fault(), HasSubstr("impossible length"));
}

TEST_F(VrpnSession, SendsATextUnderASenderOfTheClient) {
  greet();
  describe_sender(0, "sword");

  session.send_text(Severity::Warning, "gone", kNow_ns);

  const auto found = split(session.output());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].sender, 3);
  EXPECT_EQ(found[0].payload, text_payload(Severity::Warning, "gone"));
}

TEST(VrpnSenders, OfferBonesOrBodiesAndAlwaysProps) {
  const TestFrame frame({kActor, kSword});
  Senders bones(Offer::Bones);
  Senders bodies(Offer::Bodies);

  bones.add(frame.get());
  bodies.add(frame.get());

  EXPECT_THAT(bones.names(), ElementsAre("actor/Hips", "actor/Chest", "sword"));
  EXPECT_THAT(bodies.names(), ElementsAre("actor", "sword"));
  const auto reports = bodies.report(frame.get(), kAxes, kNow_ns);
  ASSERT_EQ(reports.size(), 3U);
  EXPECT_EQ(split(reports[1].messages)[0].payload, pose_payload(1, {0, 0, 1.25F}, {0, 0, 0, 1}));
  EXPECT_FALSE(reports[1].repeated);
}

TEST(VrpnSenders, KeepTheirNumbers) {
  Senders senders;
  const TestFrame both({kActor, kSword});
  const TestFrame one({kSword});

  EXPECT_TRUE(senders.add(one.get()));
  EXPECT_TRUE(senders.add(both.get()));
  EXPECT_FALSE(senders.add(one.get()));

  EXPECT_THAT(senders.names(), ElementsAre("sword", "actor", "actor/Hips", "actor/Chest"));
}

TEST(VrpnSenders, RefuseNamesThatReceiversCannotKeep) {
  TestSubject subject = kActor;
  subject.name = std::string(95, 's');
  const TestFrame frame({subject});
  Senders senders;

  senders.add(frame.get());

  EXPECT_THAT(senders.names(), ElementsAre(std::string(95, 's')));
  EXPECT_EQ(senders.refused(), 2U);
}

// VRPN has z up (the axes of the feed) or y up (glTF's).
TEST(VrpnSenders, ReportTheAxisVectors) {
  for (const auto& vector : axis_vectors(support::source_folder())) {
    TestSubject subject = kSword;
    subject.poses = {feed_pose(vector)};
    for (const auto& [axes, key] : {std::pair{MOCAP_AXES_MOCAP, "mocap"}, {MOCAP_AXES_GLTF, "gltf"}}) {
      const TestFrame frame({subject});
      Senders senders;
      senders.add(frame.get());
      const std::vector<float> p = vector.at(key).at("position");
      const std::vector<float> q = vector.at(key).at("rotation_xyzw");

      const auto reports = senders.report(frame.get(), client::Axes(axes), kNow_ns);

      ASSERT_EQ(reports.size(), 1U) << vector.at("name");
      const std::string payload = split(reports[0].messages)[0].payload;
      for (std::size_t k = 0; k < 7; ++k) {
        // Single precision: the client normalises rotations.
        EXPECT_NEAR(double_at(payload, 8 + 8 * k), k < 3 ? p[k] : q[k - 3], 1.2e-7) << vector.at("name") << ' ' << key;
      }
    }
  }
}

}  // namespace
}  // namespace mocap::vrpn
