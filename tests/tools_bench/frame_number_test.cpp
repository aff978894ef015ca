#include "bench/bridges/frame_number.h"

#include <gtest/gtest.h>

#include <string>

#include "bench/bridges/people_feed.h"
#include "bench/feed/snapshot_number.h"
#include "bridges/natnet/packets.h"
#include "bridges/rokoko/scene.h"
#include "bridges/vmc/vmc.h"
#include "bridges/vrpn/message.h"
#include "clients/messages.h"
#include "feed.h"
#include "frame.h"
#include "mocap_client.hpp"
#include "wire/codec/encode.h"

namespace frame_number_test {

using namespace mocap;         // NOLINT: the functions under test
using namespace mocap::bench;  // NOLINT: the functions under test

constexpr FrameTimes kTimes{
    .first_ns = 864'000'123'456'789, .period_ns = 8'333'333, .utc_minus_host_ns = 1'790'000'000'000'123'456};
constexpr std::uint64_t kNumber = 4321;

Description one_person() {
  Description description;
  description.session_id = "session";
  Subject person;
  person.name = "person1";
  Bone hips;
  hips.name = "Hips";
  hips.aliases.unity = "Hips";
  person.marker_set.skeleton.bones = {hips};
  person.marker_set.markers = {{"M", 0, {0.1, 0.0, 0.0}}};
  description.subjects = {person};
  return description;
}

// Frame kNumber of a feed, as a client gets it in these axes.
ClientFrame frame_in(int axes) {
  const Description description = one_person();
  const Snapshot origin = people_at_origin(description);
  Snapshot moved = origin;
  move_people(origin, kStep_m * static_cast<double>(kNumber), moved);
  moved.number = kNumber;
  moved.instants.exposed_at = from_ns(kTimes.exposed_ns(kNumber));
  const v1::Description described = wire::encode(description);
  v1::Snapshot message;
  wire::encode(moved, message);
  const client::Now now{kTimes.exposed_ns(kNumber), kTimes.exposed_ns(kNumber) + kTimes.utc_minus_host_ns};
  client::Feed feed({"tcp://127.0.0.1:5570", "snapshot", axes, 1, 1});
  feed.note({.connected = true, .since_ns = 0, .connections = 1});
  feed.take(client::testing::envelope("description", described), now);
  feed.take(client::testing::envelope("snapshot", message), now);
  ClientFrame frame;
  EXPECT_TRUE(feed.hand_out(frame.raw()->frame, now));
  return frame;
}

TEST(FrameNumber, IsReadFromTheHeaderOfANatNetFrame) {
  natnet::SceneReader reader;
  natnet::PacketWriter writer;
  const natnet::Scene& scene = reader.read(frame_in(MOCAP_AXES_MOCAP), true, 1);

  EXPECT_EQ(natnet_number(natnet::frame_packet(writer, scene, {}, 0)), kNumber);
  EXPECT_FALSE(natnet_number(natnet::unrecognised_packet(writer)).has_value());
}

TEST(FrameNumber, IsReadFromTheExposureOfAVrpnMessage) {
  const std::string packet =
      vrpn::message(vrpn::stamp_of(kTimes.exposed_ns(kNumber) + kTimes.utc_minus_host_ns), 0, 0, "payload");

  EXPECT_EQ(vrpn_number(packet, kTimes), kNumber);
}

TEST(FrameNumber, IsReadFromTheTimeOfARokokoScene) {
  const ClientFrame frame = frame_in(MOCAP_AXES_UNITY);

  EXPECT_EQ(rokoko_number(rokoko::write_scene(&frame, {}, 0.0), kTimes), kNumber);
}

TEST(FrameNumber, IsReadFromTheHipsOfVmc) {
  const ClientFrame frame = frame_in(MOCAP_AXES_UNITY);
  const auto person = frame.subject(0);
  vmc::OscBundles bundles(1400);
  vmc::write_frame(&*person, 1.0F, bundles);

  EXPECT_EQ(vmc_number(bundles.bundles().front()), kNumber);
}

TEST(FrameNumber, TruncatedPacketsHaveNone) {
  const std::string name("Hips\0\0\0\0", 8);
  for (const std::string& packet :
       {std::string(), std::string("\7\0\0", 3), name + "\1\2\3", std::string("\"timestamp\":")}) {
    EXPECT_FALSE(natnet_number(packet)) << packet.size();
    EXPECT_FALSE(vrpn_number(packet, kTimes)) << packet.size();
    EXPECT_FALSE(rokoko_number(packet, kTimes)) << packet.size();
    EXPECT_FALSE(vmc_number(packet)) << packet.size();
  }
  EXPECT_FALSE(reference_number("1234567"));
}

TEST(FrameNumber, APositionThatIsNoStepHasNone) {
  const std::string not_a_number =
      std::string("Hips\0\0\0\0", 8) + std::string(8, '\0') + "\x7f\xc0" + std::string(2, '\0');
  const std::string negative =
      std::string("Hips\0\0\0\0", 8) + std::string(8, '\0') + "\xbf\x80" + std::string(2, '\0');

  EXPECT_FALSE(vmc_number(not_a_number));
  EXPECT_FALSE(vmc_number(negative));
}

TEST(FrameNumber, IsTheFirstFieldOfASnapshot) {
  v1::Snapshot message;
  message.set_number(20'000'000);
  message.set_sequence(7);

  EXPECT_EQ(snapshot_number(message.SerializeAsString()), 20'000'000U);
  EXPECT_EQ(snapshot_number({}), 0U);
}

}  // namespace frame_number_test
