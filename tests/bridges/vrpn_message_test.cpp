#include "bridges/vrpn/message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>

namespace mocap::vrpn {
namespace {

using ::testing::ElementsAreArray;
using Bytes = std::vector<int>;

Bytes bytes_of(const std::string& text) {
  Bytes bytes;
  for (const char byte : text) bytes.push_back(static_cast<unsigned char>(byte));
  return bytes;
}

std::string zeros(std::size_t count) { return std::string(count, '\0'); }

TEST(VrpnMessage, CookieHas24BytesAndTheVersion) { EXPECT_EQ(cookie(), "vrpn: ver. 07.38  0" + zeros(5)); }

TEST(VrpnMessage, AcceptsCookiesOfEveryMinorVersionOf7) {
  EXPECT_TRUE(is_cookie("vrpn: ver. 07.33  0" + zeros(5)));
  EXPECT_FALSE(is_cookie("vrpn: ver. 06.00  0" + zeros(5)));
  EXPECT_FALSE(is_cookie("GET / HTTP/1.1\r\nHost: a"));
  EXPECT_FALSE(is_cookie(""));
}

TEST(VrpnMessage, HasABigEndianHeaderAndPaddingThatTheLengthDoesNotCount) {
  const std::string found = message({0x01020304, 5}, 7, 2, "abcde");

  EXPECT_THAT(bytes_of(found), ElementsAreArray(Bytes{0, 0, 0, 29, 1, 2, 3, 4, 0,  0,  0,  5,   0,   0, 0, 7,
                                                      0, 0, 0, 2,  0, 0, 0, 0, 97, 98, 99, 100, 101, 0, 0, 0}));
}

TEST(VrpnMessage, NumbersAMessage) {
  std::string bytes = message({}, 0, 0, "") + message({}, 0, 0, "");

  number_message(bytes, 24, 0x01020304);

  EXPECT_EQ(bytes.substr(20, 4), zeros(4));
  EXPECT_EQ(bytes.substr(44, 4), "\1\2\3\4");
}

TEST(VrpnMessage, DescribesANameWithItsLengthAndAZeroByte) {
  EXPECT_EQ(describe_name("actor/Hips"), std::string("\0\0\0\x0b", 4) + "actor/Hips" + zeros(1));
}

TEST(VrpnMessage, PosePayloadHasTheSensorAndDoubles) {
  const std::string found = pose_payload(3, {1.0F, -0.5F, 2.0F}, {0.0F, 0.0F, 0.5F, -1.0F});

  ASSERT_EQ(found.size(), 64U);
  EXPECT_THAT(bytes_of(found.substr(0, 24)), ElementsAreArray(Bytes{0, 0, 0, 3, 0,    0,    0, 0, 0x3f, 0xf0, 0, 0,
                                                                    0, 0, 0, 0, 0xbf, 0xe0, 0, 0, 0,    0,    0, 0}));
  EXPECT_EQ(bytes_of(found.substr(56)), (Bytes{0xbf, 0xf0, 0, 0, 0, 0, 0, 0}));
}

double double_at(const std::string& bytes, std::size_t start) {
  std::uint64_t bits = 0;
  for (const char byte : bytes.substr(start, 8)) bits = bits << 8U | static_cast<unsigned char>(byte);
  return std::bit_cast<double>(bits);
}

TEST(VrpnMessage, VelocityPayloadHasTheRotationOfAHundredthOfASecond) {
  const std::string found = velocity_payload(0, {1.0F, 2.0F, 3.0F}, {0.0F, 0.0F, 4.0F});

  ASSERT_EQ(found.size(), 72U);
  EXPECT_EQ(double_at(found, 8), 1.0);
  EXPECT_EQ(double_at(found, 24), 3.0);
  EXPECT_EQ(double_at(found, 32), 0.0);
  EXPECT_NEAR(double_at(found, 48), std::sin(0.02), 1e-12);  // half of 4 rad/s x 0.01 s, about z
  EXPECT_NEAR(double_at(found, 56), std::cos(0.02), 1e-12);
  EXPECT_EQ(double_at(found, 64), 0.01);
}

TEST(VrpnMessage, VelocityPayloadOfABodyAtRestIsTheIdentity) {
  const std::string found = velocity_payload(0, {}, {});

  EXPECT_EQ(double_at(found, 48), 0.0);
  EXPECT_EQ(double_at(found, 56), 1.0);
}

TEST(VrpnMessage, TextPayloadIsBoundedAndEndsWithAZeroByte) {
  EXPECT_EQ(text_payload(Severity::Warning, "gone"), std::string("\0\0\0\1\0\0\0\0gone\0", 13));
  EXPECT_EQ(text_payload(Severity::Normal, std::string(5000, 'a')).size(), 8U + 1024U);
}

TEST(VrpnMessage, StampRoundsDownAlsoBeforeTheEpoch) {
  EXPECT_EQ(stamp_of(1'500'000'999).seconds, 1);
  EXPECT_EQ(stamp_of(1'500'000'999).microseconds, 500'000);
  EXPECT_EQ(stamp_of(-1).seconds, -1);
  EXPECT_EQ(stamp_of(-1).microseconds, 999'999);
}

TEST(VrpnReader, FindsMessagesInBytesThatArriveOneByOne) {
  const std::string stream = message({}, 4, -1, describe_name("actor")) + message({}, 5, 9, "");
  MessageReader reader;
  std::vector<std::pair<int, std::string>> found;

  for (const char byte : stream) {
    reader.append(std::string_view(&byte, 1));
    while (const auto next = reader.next()) found.emplace_back(next->sender, next->payload);
  }

  EXPECT_EQ(found, (std::vector<std::pair<int, std::string>>{{4, describe_name("actor")}, {5, ""}}));
  EXPECT_FALSE(reader.broken());
}

TEST(VrpnReader, IsBrokenByAnImpossibleLength) {
  for (const std::string& length : {std::string("\0\0\0\x17", 4), std::string("\x7f\xff\xff\xff", 4),
                                    std::string("\xff\xff\xff\xff", 4), std::string("\0\0\x20\x01", 4)}) {
    MessageReader reader;
    reader.append(length + zeros(20));

    EXPECT_FALSE(reader.next().has_value());
    EXPECT_TRUE(reader.broken());
  }
}

TEST(VrpnReader, ReadsNamesWithinTheirBounds) {
  EXPECT_EQ(name_in(describe_name("vrpn_Base ping_message")), kPing);
  EXPECT_EQ(name_in(describe_name(std::string(99, 'n'))), std::string(99, 'n'));
  EXPECT_EQ(name_in(describe_name(std::string(100, 'n'))), std::nullopt);
  EXPECT_EQ(name_in(std::string("\0\0\0", 3)), std::nullopt);
  EXPECT_EQ(name_in(describe_name("")), std::nullopt);
  EXPECT_EQ(name_in(std::string("\x7f\xff\xff\xff", 4) + "a"), "a");  // no zero byte, and a length that lies
}

TEST(VrpnRequest, HasThePortAfterTheLastSpace) {
  EXPECT_EQ(callback_port(std::string("192.168.0.7 34567\0", 18)), 34567);
  EXPECT_EQ(callback_port("lab.example 4500"), 4500);
  for (const std::string& wrong :
       {std::string{}, std::string("34567"), std::string(" 34567"), std::string("a 0"), std::string("a 65536"),
        std::string("a -1"), std::string("a 12x"), std::string("a "), std::string(257, '1') + " 5"}) {
    EXPECT_EQ(callback_port(wrong), std::nullopt) << wrong;
  }
}

}  // namespace
}  // namespace mocap::vrpn
