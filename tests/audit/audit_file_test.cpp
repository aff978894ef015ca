#include "audit/audit_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <algorithm>

#include <fstream>
#include <iterator>

#include "support/file_size_limit.h"
#include "support/temporary_folder.h"

namespace mocap::audit {
namespace audit_file_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::uint64_t kLarge_bytes = 1'000'000;

std::string text_of(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

AuditEntry entry(const std::string& name) { return {.what = "ordered", .details = {{"name", name}}}; }

TEST(AuditFile, AppendsToTheLinesThatAreThere) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl";
  for (const char* name : {"one", "two"}) {
    AuditFile file(path, kLarge_bytes, 2);
    ASSERT_TRUE(file.append(entry(name)));
    ASSERT_TRUE(file.sync());
  }

  const std::string text = text_of(path);

  EXPECT_LT(text.find("one"), text.find("two"));
  EXPECT_EQ(std::ranges::count(text, '\n'), 2);
}

TEST(AuditFile, IsReadableByOwnerAndGroupAloneWhateverTheUmask) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl", open = folder.write("open.jsonl", "");
  fs::permissions(open, fs::perms::all);
  const mode_t before = ::umask(077);
  AuditFile narrow(path, kLarge_bytes, 2), wide(open, kLarge_bytes, 2);

  ASSERT_TRUE(narrow.append(entry("a")));
  ASSERT_TRUE(wide.append(entry("a")));
  ::umask(before);

  for (const fs::path& each : {path, open}) {
    EXPECT_EQ(fs::status(each).permissions(), fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read);
  }
}

TEST(AuditFile, FollowsNoSymbolicLinkAndWritesIntoNoPipe) {
  const support::TemporaryFolder folder;
  const fs::path target = folder.write("precious", "text"), link = folder.path() / "audit.jsonl";
  fs::create_symlink(target, link);
  const fs::path pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);

  const Status linked = AuditFile(link, kLarge_bytes, 2).append(entry("a"));
  const Status piped = AuditFile(pipe, kLarge_bytes, 2).append(entry("a"));

  ASSERT_FALSE(linked);
  EXPECT_THAT(linked.error().message, HasSubstr("is a symbolic link"));
  EXPECT_FALSE(piped);
  EXPECT_EQ(text_of(target), "text");
}

TEST(AuditFile, KeepsTheNewestFilesWithinItsBound) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl";
  AuditFile file(path, 500, 2);

  for (int i = 0; i < 40; ++i) ASSERT_TRUE(file.append(entry("number " + std::to_string(i) + ".")));

  EXPECT_THAT(text_of(path), HasSubstr("number 39."));
  EXPECT_FALSE(fs::exists(path.string() + ".3"));
  std::string kept = text_of(path.string() + ".2") + text_of(path.string() + ".1") + text_of(path);
  EXPECT_LE(kept.size(), 3 * 500U);
  EXPECT_GT(kept.size(), 2 * 400U);
  for (const char* older : {".1", ".2"}) EXPECT_LE(fs::file_size(path.string() + older), 500U);
  std::size_t before = 0;
  for (int i = 30; i < 40; ++i) {
    const std::size_t at = kept.find("number " + std::to_string(i) + ".");
    ASSERT_NE(at, std::string::npos) << i;
    EXPECT_GE(at, before);
    before = at;
  }
}

TEST(AuditFile, WritesWholeLinesOrNothingOnAFullDiskAndGoesOnAfterwards) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl";
  AuditFile file(path, kLarge_bytes, 2);
  ASSERT_TRUE(file.append(entry("before")));
  {
    const support::FileSizeLimit full(fs::file_size(path) + 20);

    const Status refused = file.append(entry("meanwhile"));

    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::Io);
    EXPECT_THAT(refused.error().message, HasSubstr("free space"));
  }

  ASSERT_TRUE(file.append(entry("after")));

  const std::string text = text_of(path);
  EXPECT_EQ(std::ranges::count(text, '\n'), 2);
  EXPECT_EQ(text.find("meanwhile"), std::string::npos);
  EXPECT_THAT(text, HasSubstr("\"name\":\"after\"}\n"));
}

TEST(AuditFile, BeginsANewLineAfterOneThatACrashCutOff) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.write("audit.jsonl", "{\"at\":\"2026");

  ASSERT_TRUE(AuditFile(path, kLarge_bytes, 2).append(entry("next")));

  EXPECT_TRUE(text_of(path).starts_with("{\"at\":\"2026\n{\"at\":\"19"));
}

TEST(AuditFile, IsMadeAnewIfItWasRemoved) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl";
  AuditFile file(path, kLarge_bytes, 2);
  ASSERT_TRUE(file.append(entry("one")));
  fs::remove(path);

  ASSERT_TRUE(file.append(entry("two")));

  EXPECT_THAT(text_of(path), HasSubstr("two"));
}

TEST(AuditFile, IsMadeAnewIfItWasMovedAway) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl", moved = folder.path() / "moved.jsonl";
  const fs::path older = folder.write("audit.jsonl.1", "older"), oldest = folder.write("audit.jsonl.2", "oldest");
  AuditFile file(path, 500, 2);
  ASSERT_TRUE(file.append(entry("one")));
  fs::rename(path, moved);

  for (const char* name : {"two", "three"}) ASSERT_TRUE(file.append(entry(name + std::string(300, 'x'))));

  EXPECT_EQ(std::ranges::count(text_of(moved), '\n'), 1);
  EXPECT_THAT(text_of(older), HasSubstr("two"));
  EXPECT_EQ(text_of(oldest), "older");
  EXPECT_THAT(text_of(path), HasSubstr("three"));
}

TEST(AuditFile, MovesNoOlderFileIfTheirFirstNumberIsFree) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl";
  const fs::path older = folder.write("audit.jsonl.2", "older"), oldest = folder.write("audit.jsonl.3", "oldest");
  AuditFile file(path, 1, 3);

  for (const char* name : {"one", "two"}) ASSERT_TRUE(file.append(entry(name)));

  EXPECT_THAT(text_of(path.string() + ".1"), HasSubstr("one"));
  EXPECT_EQ(text_of(older), "older");
  EXPECT_EQ(text_of(oldest), "oldest");
}

TEST(AuditFile, NamesBothFilesIfItCannotBeRenamed) {
  const support::TemporaryFolder folder;
  const fs::path path = folder.path() / "audit.jsonl";
  fs::create_directory(path.string() + ".1");
  AuditFile file(path, 1, 1);
  ASSERT_TRUE(file.append(entry("one")));

  const Status refused = file.append(entry("two"));

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr(path.string() + ": cannot be renamed to " + path.string() + ".1"));
  EXPECT_EQ(std::ranges::count(text_of(path), '\n'), 1);
}

TEST(AuditSettings, MakeNoWriterWithoutAFile) {
  const support::TemporaryFolder folder;
  AuditSettings settings;
  settings.file = folder.path() / "audit.jsonl";
  EXPECT_NE(make_audit_writer(settings), nullptr);
  settings.on = false;
  EXPECT_EQ(make_audit_writer(settings), nullptr);
  settings = {};
  settings.file.clear();
  EXPECT_EQ(make_audit_writer(settings), nullptr);
}

}  // namespace audit_file_test
}  // namespace mocap::audit
