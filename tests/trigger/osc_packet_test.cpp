#include "trigger/osc_packet.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::trigger {
namespace osc_packet_test {

using ::testing::HasSubstr;
using namespace std::string_literals;

std::string why_refused(const std::string& packet) {
  const auto request = read_osc(packet);
  return request ? std::string() : request.error().message;
}

const std::string kStart = "/RecordStart\0\0\0\0,si\0walk\0\0\0\0\0\0\0\3"s;

TEST(OscPacket, ReadsAStartWithSlateAndTake) {
  const auto request = read_osc(kStart);

  ASSERT_TRUE(request) << request.error().message;
  EXPECT_EQ(request->verb, Verb::Start);
  EXPECT_EQ(request->dialect, Dialect::Osc);
  EXPECT_EQ(request->slate, "walk");
  EXPECT_EQ(request->name, "walk_003");
}

TEST(OscPacket, ReadsAStartWithoutValuesAndAStop) {
  const auto plain = read_osc("/RecordStart\0\0\0\0,\0\0\0"s);
  const auto empty = read_osc("/RecordStart\0\0\0\0,s\0\0\0\0\0\0"s);
  const auto bare = read_osc("/RecordStop\0"s);
  const auto stop = read_osc("/RecordStop\0,TfF\0\0\0\0\0\0\0\0"s);

  ASSERT_TRUE(plain && empty && bare && stop) << stop.error().message;
  EXPECT_EQ(plain->name + plain->slate + empty->name + empty->slate, "");
  EXPECT_EQ(bare->verb, Verb::Stop);
  EXPECT_EQ(stop->verb, Verb::Stop);
}

TEST(OscPacket, ReadsABundleOfOneMessage) {
  const std::string head = "#bundle\0\0\0\0\0\0\0\0\1"s;

  EXPECT_TRUE(read_osc(head + "\0\0\0\x20"s + kStart));
  EXPECT_THAT(why_refused(head + "\0\0\0\x0c"s + kStart), HasSubstr("expected one with one message"));
  EXPECT_THAT(why_refused(head), HasSubstr("expected one with one message"));
}

TEST(OscPacket, RefusesAPacketThatIsNotComplete) {
  for (std::size_t size = 0; size < kStart.size(); ++size) {
    if (size == 16) continue;  // an address alone is a message of old senders
    EXPECT_NE(why_refused(kStart.substr(0, size)), "") << size;
  }
  EXPECT_THAT(why_refused(kStart + "\0\0\0\0"s), HasSubstr("bytes follow"));
  EXPECT_THAT(why_refused("/RecordStop\0,b\0\0"s), HasSubstr("value of type 'b'"));
  EXPECT_THAT(why_refused("/RecordStop\0x\0\0\0"s), HasSubstr("no types"));
  EXPECT_THAT(why_refused("/RecordStop\0,"s + std::string(17, 'T') + "\0\0"s), HasSubstr("more than 16"));
  EXPECT_THAT(why_refused(std::string(9000, '/')), HasSubstr("expected at most 8192"));
}

TEST(OscPacket, RefusesOtherMessages) {
  EXPECT_THAT(why_refused("/Play\0\0\0"s), HasSubstr("is OSC /Play, expected /RecordStart"));
}

TEST(OscPacket, RefusesASlateThatIsNotAscii) {
  EXPECT_THAT(why_refused("/RecordStart\0\0\0\0,s\0\0\xff\xfe\0\0"s), HasSubstr("not ASCII"));
}

TEST(OscPacket, WritesMessagesByteByByte) {
  EXPECT_EQ(write_osc("/RecordStart", {"walk", 3}), kStart);
  EXPECT_EQ(write_osc("/RecordStop", {}), "/RecordStop\0,\0\0\0"s);
  EXPECT_EQ(write_osc("/A", {"abc", -2}), "/A\0\0,si\0abc\0\xff\xff\xff\xfe"s);
}

}  // namespace osc_packet_test
}  // namespace mocap::trigger
