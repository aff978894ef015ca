#include "wire/codec/utf8.h"

#include <google/protobuf/wrappers.pb.h>
#include <gtest/gtest.h>

#include <random>
#include <string>

namespace mocap::wire {
namespace utf8_test {

/// The bytes of a code point, encoded by the bit patterns of RFC 3629 in `length` bytes, valid or not.
std::string encoded(std::uint32_t code_point, int length) {
  if (length == 1) return {static_cast<char>(code_point)};
  std::string bytes;
  const std::uint32_t lead = (0xF00U >> length) & 0xFFU;
  for (int i = length - 1; i >= 0; --i) {
    const std::uint32_t six = (code_point >> (6 * i)) & 0x3FU;
    bytes += static_cast<char>(i == length - 1 ? (lead | six) : (0x80U | six));
  }
  return bytes;
}

TEST(ValidUtf8, KeepsEveryCodePointInItsShortestForm) {
  for (std::uint32_t c = 0; c <= 0x10FFFF; ++c) {
    if (c >= 0xD800 && c <= 0xDFFF) continue;  // surrogates are no code points of UTF-8
    const std::string text = encoded(c, c < 0x80 ? 1 : c < 0x800 ? 2 : c < 0x10000 ? 3 : 4);
    ASSERT_EQ(valid_utf8(text), text) << c;
  }
}

TEST(ValidUtf8, ReplacesEachByteOfAnInvalidSequence) {
  EXPECT_EQ(valid_utf8(encoded(0x2F, 2)), "??") << "overlong";
  EXPECT_EQ(valid_utf8(encoded(0x7FF, 3)), "???") << "overlong";
  EXPECT_EQ(valid_utf8(encoded(0xFFFF, 4)), "????") << "overlong";
  EXPECT_EQ(valid_utf8(encoded(0xD800, 3)), "???") << "surrogate";
  EXPECT_EQ(valid_utf8(encoded(0x110000, 4)), "????") << "beyond the last code point";
  EXPECT_EQ(valid_utf8("a\x80z\xFF"), "a?z?");
  EXPECT_EQ(valid_utf8("caf\xC3"), "caf?") << "ends within a sequence";
  EXPECT_EQ(valid_utf8("\xE2\x82z"), "??z") << "another character within a sequence";
  EXPECT_EQ(valid_utf8(""), "");
}

TEST(ValidUtf8, GivesTextThatProtobufParses) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 2000; ++i) {
    std::string text;
    for (int k = 0; k < 12; ++k) text += static_cast<char>(byte(random));
    google::protobuf::StringValue message;
    message.set_value(valid_utf8(text));

    EXPECT_TRUE(google::protobuf::StringValue().ParseFromString(message.SerializeAsString())) << i;
  }
}

TEST(AssignValidUtf8, ReplacesTheTextAndKeepsTheMemory) {
  std::string into(100, 'x');
  const void* const memory = into.data();

  assign_valid_utf8("short\x80", into);

  EXPECT_EQ(into, "short?");
  EXPECT_EQ(into.data(), memory);
}

}  // namespace utf8_test
}  // namespace mocap::wire
