#include "audit/audit_line.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::audit {
namespace audit_line_test {

using ::testing::HasSubstr;

constexpr std::int64_t kAt_ns = 1'795'716'920'123'456'789;  // 2026-11-26 18:15:20 UTC

TEST(AuditLine, HasTimeKindAndActorFirst) {
  const AuditEntry entry{
      .what = "ordered",
      .who = {.name = "anna", .key = "k", .address = "10.0.0.7:51234", .role = "operator", .states = "ben"},
      .details = {{"order", "take start"}, {"take", ""}},
      .at_utc_ns = kAt_ns};

  EXPECT_EQ(to_line(entry),
            "{\"at\":\"2026-11-26T18:15:20.123456Z\",\"what\":\"ordered\",\"who\":\"anna\",\"states\":\"ben\","
            "\"role\":\"operator\",\"from\":\"10.0.0.7:51234\",\"key\":\"k\",\"order\":\"take start\"}\n");
}

TEST(AuditLine, NamesAnActorWithoutAKeyByItsAddressAndTheDaemonItself) {
  EXPECT_THAT(to_line({.what = "connected", .who = {.address = "127.0.0.1:5"}}), HasSubstr("\"who\":\"127.0.0.1\""));
  EXPECT_THAT(to_line({.what = "connected", .who = {.address = "local"}}), HasSubstr("\"who\":\"local\""));
  EXPECT_THAT(to_line({.what = "started"}), HasSubstr("\"who\":\"mocapd\""));
}

TEST(AuditLine, IsOneLineWhateverAClientSends) {
  const std::string hostile = std::string("a\"b\\c\n\t\x7f\xff\xc0\xaf z\xc3\xa4", 15) + std::string(1, '\0');

  const std::string line = to_line({.what = "refused", .who = {.states = hostile}});

  EXPECT_EQ(line.find('\n'), line.size() - 1);
  EXPECT_THAT(line, HasSubstr(R"("states":"a\"b\\c\u000a\u0009\u007f??? zä\u0000")"));
}

TEST(AuditLine, ShortensALongValueBetweenCharacters) {
  std::string text;
  for (std::size_t i = 0; i < kLongestValue; ++i) text += "\xe2\x82\xac";  // three bytes each

  const std::string line = to_line({.what = "ordered", .details = {{"text", text}}});

  EXPECT_LT(line.size(), kLongestValue + 200);
  EXPECT_THAT(line, HasSubstr("\xe2\x82\xac...\"}"));
}

}  // namespace audit_line_test
}  // namespace mocap::audit
