#include "trigger/receivers.h"

#include <gmock/gmock.h>

namespace mocap::trigger {
namespace receivers_test {

using testing::HasSubstr;

constexpr std::uint32_t kFirst = 0x0a000007;  // 10.0.0.7

TriggerSettings settings() {
  TriggerSettings settings;
  settings.xml_receivers = {"10.0.0.7:30", "10.0.0.8:1512"};
  settings.osc_receivers = {"10.0.0.9:8000"};
  return settings;
}

CapturePacket start() { return {.verb = Verb::Start, .name = "walk"}; }

Request answer_of(const std::string& packet_id, const std::string& name) {
  Request request;
  request.packet_id = packet_id;
  request.name = name;
  return request;
}

TEST(Receivers, TellsAllByTheirProtocolExceptWhoKnows) {
  Receivers receivers(settings(), 3, 100);
  std::vector<Datagram> packets;

  EXPECT_EQ(receivers.notify(start(), {kFirst}, packets), 2U);

  ASSERT_EQ(packets.size(), 2U);
  EXPECT_EQ(packets[0].socket, 3U);
  EXPECT_EQ(packets[0].peer.port, 1512);
  EXPECT_THAT(packets[0].bytes, HasSubstr("CaptureStart"));
  EXPECT_THAT(packets[0].bytes, HasSubstr("100"));
  EXPECT_THAT(packets[1].bytes, HasSubstr("/RecordStart"));
}

TEST(Receivers, OscHearsNothingOfACompleteFile) {
  Receivers receivers(settings(), 0, 1);
  std::vector<Datagram> packets;

  EXPECT_EQ(receivers.notify({.verb = Verb::Complete, .name = "walk"}, {}, packets), 2U);
}

TEST(Receivers, RecognisesTheLast64OfItsPackets) {
  Receivers receivers(settings(), 0, 1);
  std::vector<Datagram> packets;
  for (int i = 0; i < 65; ++i) receivers.notify(start(), {}, packets);

  EXPECT_FALSE(receivers.is_own(answer_of("1", "walk")));
  EXPECT_TRUE(receivers.is_own(answer_of("2", "walk")));
  EXPECT_TRUE(receivers.is_own(answer_of("65", "walk")));
  EXPECT_FALSE(receivers.is_own(answer_of("65", "run")));
  EXPECT_FALSE(receivers.is_own(answer_of("", "walk")));
}

TEST(Receivers, KnowsTheirAddresses) {
  const Receivers receivers(settings(), 0, 1);

  EXPECT_TRUE(receivers.contains(kFirst));
  EXPECT_TRUE(receivers.contains(0x0a000009));
  EXPECT_FALSE(receivers.contains(0x0a000001));
}

}  // namespace receivers_test
}  // namespace mocap::trigger
