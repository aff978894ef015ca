#include "ctl/audit/audit_log.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace audit_log_test {

constexpr std::int64_t kNow_s = 1'795'716'920;  // 2026-11-26 18:15:20 UTC

std::string line(const std::string& at, const std::string& what, const std::string& who, const std::string& more = "") {
  return "{\"at\":\"" + at + "\",\"what\":\"" + what + "\",\"who\":\"" + who + "\"" + more + "}\n";
}

std::vector<std::string> read(const std::filesystem::path& file, const AuditFilter& filter) {
  std::vector<std::string> found;
  const auto damaged =
      read_audit(file, filter, [&](const AuditLine& each) { found.push_back(each.what + " " + each.who); });
  EXPECT_TRUE(damaged);
  return found;
}

TEST(AuditLog, ReadsTheOlderFilesFirst) {
  const support::TemporaryFolder folder;
  folder.write("a.jsonl.2", line("2026-11-24T00:00:00.000000Z", "started", "mocapd"));
  folder.write("a.jsonl.1", line("2026-11-25T00:00:00.000000Z", "ordered", "anna"));
  const auto file = folder.write("a.jsonl", line("2026-11-26T00:00:00.000000Z", "ended", "mocapd"));

  EXPECT_EQ(read(file, {}), (std::vector<std::string>{"started mocapd", "ordered anna", "ended mocapd"}));
  EXPECT_EQ(read(file, {.since = "2026-11-25"}), (std::vector<std::string>{"ordered anna", "ended mocapd"}));
  EXPECT_EQ(read(file, {.what = "ordered"}), std::vector<std::string>{"ordered anna"});
}

TEST(AuditLog, FindsAPersonByKeyNameStatedNameAndAddress) {
  const support::TemporaryFolder folder;
  const auto file = folder.write(
      "a.jsonl", line("2026-11-26T00:00:00Z", "ordered", "web", ",\"states\":\"anna\",\"from\":\"10.0.0.7:5\"") +
                     line("2026-11-26T00:00:01Z", "ordered", "ben", ",\"from\":\"10.0.0.8:5\",\"key\":\"K\"") +
                     line("2026-11-26T00:00:02Z", "retained", "mocapd"));

  EXPECT_EQ(read(file, {.who = "anna"}), std::vector<std::string>{"ordered web"});
  EXPECT_EQ(read(file, {.who = "web"}), std::vector<std::string>{"ordered web"});
  EXPECT_EQ(read(file, {.who = "10.0.0.8"}), std::vector<std::string>{"ordered ben"});
  EXPECT_EQ(read(file, {.who = "K"}), std::vector<std::string>{"ordered ben"});
  EXPECT_TRUE(read(file, {.who = "an"}).empty());
}

TEST(AuditLog, CountsDamagedLinesAndReadsTheOthers) {
  const support::TemporaryFolder folder;
  const auto file = folder.write("a.jsonl", "{\"at\":\"2026\n" + line("2026-11-26T00:00:00Z", "ended", "mocapd") +
                                                "[1]\n{\"at\":1,\"what\":\"a\",\"who\":\"b\"}\n");
  int shown = 0;

  const auto damaged = read_audit(file, {}, [&](const AuditLine&) { ++shown; });

  ASSERT_TRUE(damaged);
  EXPECT_EQ(*damaged, 3U);
  EXPECT_EQ(shown, 1);
  EXPECT_EQ(read_audit(folder.path() / "none", {}, {}).error().code, ErrorCode::NotFound);
}

TEST(AuditLog, ReadsATimeOrAnAge) {
  EXPECT_EQ(since_text("2h", kNow_s), "2026-11-26T16:15:20");
  EXPECT_EQ(since_text("7d", kNow_s), "2026-11-19T18:15:20");
  EXPECT_EQ(since_text("2026-11-26", kNow_s), "2026-11-26");
  EXPECT_EQ(since_text("2026-11-26T18:15:20Z", kNow_s), "2026-11-26T18:15:20");
  for (const char* wrong : {"", "h", "2", "-2h", "2w", "2h ", "2026-13", "9999999999h", "2026-11-26 18:15:20"}) {
    EXPECT_EQ(since_text(wrong, kNow_s), std::nullopt) << wrong;
  }
}

}  // namespace audit_log_test
}  // namespace mocap::ctl
