#include "web/takes/take_files.h"

#include <gmock/gmock.h>

#include <cstring>

#include "mocap/v1/snapshot.pb.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::web {
namespace take_files_test {

using testing::HasSubstr;

constexpr std::uint64_t kSets = 240;  // two seconds

struct Message {
  char kind = 0;
  double at_s = 0.0;
  std::string bytes;
};

std::vector<Message> split(const std::string& piece) {
  std::vector<Message> messages;
  for (std::size_t at = 0; at < piece.size();) {
    std::uint32_t size = 0;
    Message message;
    std::memcpy(&size, piece.data() + at, sizeof(size));
    message.kind = piece[at + 4];
    std::memcpy(&message.at_s, piece.data() + at + 5, sizeof(message.at_s));
    message.bytes = piece.substr(at + 13, size - 9);
    messages.push_back(message);
    at += 4 + size;
  }
  return messages;
}

TEST(TakeFiles, ListsTheNewestTakeFirst) {
  const support::TemporaryFolder folder;
  take::record_example(folder.path() / "old.mcap", 12);
  take::record_example(folder.path() / "new.mcap", kSets);
  folder.write("broken.mcap", "no take");
  folder.write("notes.txt", "no take either");
  folder.write(".walk.part.mcap", "a take that is not whole yet");
  const auto written = std::filesystem::last_write_time(folder.path() / "old.mcap");
  std::filesystem::last_write_time(folder.path() / "new.mcap", written + std::chrono::hours(1));
  std::filesystem::last_write_time(folder.path() / "broken.mcap", written - std::chrono::hours(1));

  const auto list = list_takes(folder.path());

  ASSERT_TRUE(list) << list.error().message;
  const auto& takes = (*list)["takes"];
  ASSERT_EQ(takes.size(), 3U);
  EXPECT_EQ(takes[0]["name"], "new");
  EXPECT_EQ(takes[0]["state"], "complete");
  EXPECT_EQ(takes[0]["slate"], "12A");
  EXPECT_EQ(takes[0]["number"], 3);
  EXPECT_EQ(takes[0]["tags"], (std::vector<std::string>{"walk", "two subjects"}));
  EXPECT_NEAR(takes[0]["seconds"].get<double>(), 2.0, 0.02);
  EXPECT_EQ(takes[1]["name"], "old");
  EXPECT_EQ(takes[2]["state"], "unreadable");
  EXPECT_EQ(list_takes(folder.path() / "none").error().code, ErrorCode::NotFound);
}

TEST(TakeFiles, RefusesNamesOutsideTheFolder) {
  const support::TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "takes");
  take::record_example(folder.path() / "secret.mcap", 3);
  std::filesystem::create_symlink(folder.path() / "secret.mcap", folder.path() / "takes" / "link.mcap");
  const auto fails = [&](const std::string& name) { return take_file(folder.path() / "takes", name).error().code; };

  for (const char* name : {"../secret", "", ".", "..", ".hidden", "a/b", "/etc/passwd", "a\nb"})
    EXPECT_EQ(fails(name), ErrorCode::InvalidArgument) << name;
  EXPECT_EQ(fails(std::string("secret\0", 7)), ErrorCode::InvalidArgument);
  EXPECT_EQ(fails(std::string(300, 'a')), ErrorCode::InvalidArgument);
  EXPECT_EQ(fails("link"), ErrorCode::NotFound);
  EXPECT_EQ(fails("none"), ErrorCode::NotFound);
}

TEST(TakeFiles, ShowsAndVerifiesATake) {
  const support::TemporaryFolder folder;
  take::record_example(folder.path() / "walk.mcap", 12);

  const auto shown = show_take(folder.path() / "walk.mcap");
  const auto verified = verify_take(folder.path() / "walk.mcap");

  ASSERT_TRUE(shown) << shown.error().message;
  EXPECT_EQ((*shown)["name"], "walk");
  EXPECT_EQ((*shown)["report"]["topics"]["snapshot"]["messages"], 12);
  EXPECT_TRUE((*shown)["report"]["quality"].is_object());
  ASSERT_TRUE(verified) << verified.error().message;
  EXPECT_EQ((*verified)["valid"], true);
}

TEST(TakeFiles, ChangesATake) {
  const support::TemporaryFolder folder;
  const auto file = folder.path() / "walk.mcap";
  take::record_example(file, 12);

  EXPECT_TRUE(change_take(file, "edit", R"({"notes":"again","rating":4,"tags":["best"]})"));
  EXPECT_TRUE(change_take(file, "rename", R"({"name":"walk best"})"));

  const auto renamed = folder.path() / "walk best.mcap";
  const auto shown = show_take(renamed);
  ASSERT_TRUE(shown) << shown.error().message;
  EXPECT_EQ((*shown)["notes"], "again");
  EXPECT_EQ((*shown)["rating"], 4);
  EXPECT_EQ((*shown)["tags"], std::vector<std::string>{"best"});
  EXPECT_EQ((*shown)["slate"], "12A");
  EXPECT_TRUE(change_take(renamed, "delete", "{}"));
  EXPECT_FALSE(std::filesystem::exists(renamed));
}

TEST(TakeFiles, RefusesAChangeWithDeepNestingWithoutRecursion) {
  constexpr int kDepth = 1'000'000;
  const support::TemporaryFolder folder;
  const auto file = folder.path() / "walk.mcap";
  take::record_example(file, 3);

  const auto changed =
      change_take(file, "edit", R"({"notes":)" + std::string(kDepth, '[') + std::string(kDepth, ']') + "}");

  ASSERT_FALSE(changed);
  EXPECT_THAT(changed.error().message, HasSubstr("at most 32 nested brackets"));
}

TEST(TakeFiles, NamesTheFaultOfAChange) {
  const support::TemporaryFolder folder;
  const auto file = folder.path() / "walk.mcap";
  take::record_example(file, 3);
  take::record_example(folder.path() / "run.mcap", 3);
  const auto fault = [&](const char* verb, const char* params) {
    return change_take(file, verb, params).error().message;
  };

  EXPECT_THAT(fault("edit", "[]"), HasSubstr("expected an object"));
  EXPECT_THAT(fault("edit", R"({"rating":6})"), HasSubstr("expected 0 to 5"));
  EXPECT_THAT(fault("edit", R"({"rating":"5"})"), HasSubstr("expected 0 to 5"));
  EXPECT_THAT(fault("edit", R"({"notes":7})"), HasSubstr("expected a text"));
  EXPECT_THAT(fault("edit", R"({"tags":["a",1]})"), HasSubstr("expected a list of texts"));
  EXPECT_THAT(fault("edit", R"({"color":"red"})"), HasSubstr("unknown key 'color'"));
  EXPECT_THAT(fault("rename", "{}"), HasSubstr("name is missing"));
  EXPECT_THAT(fault("rename", R"({"name":"../out"})"), HasSubstr("without '/'"));
  EXPECT_THAT(fault("rename", R"({"name":"run"})"), HasSubstr("run"));
  EXPECT_TRUE(std::filesystem::exists(file));
}

TEST(TakeFiles, BringsAPieceWithTheDescriptionInForce) {
  const support::TemporaryFolder folder;
  take::record_example(folder.path() / "walk.mcap", kSets);

  const auto piece = take_piece(folder.path() / "walk.mcap", 1.0, 0.5);

  ASSERT_TRUE(piece) << piece.error().message;
  const auto messages = split(*piece);
  ASSERT_EQ(messages.size(), 61U);
  EXPECT_EQ(messages[0].kind, 'd');
  EXPECT_EQ(messages[1].kind, 's');
  EXPECT_NEAR(messages[1].at_s, 1.0, 0.01);
  v1::Snapshot snapshot;
  ASSERT_TRUE(snapshot.ParseFromString(messages[1].bytes));
  EXPECT_NEAR(static_cast<double>(snapshot.number()), 120.0, 1.0);
}

TEST(TakeFiles, BringsNothingAfterTheEnd) {
  const support::TemporaryFolder folder;
  take::record_example(folder.path() / "walk.mcap", 12);

  const auto piece = take_piece(folder.path() / "walk.mcap", 1e300, 10.0);

  ASSERT_TRUE(piece) << piece.error().message;
  EXPECT_EQ(split(*piece).size(), 1U);
}

}  // namespace take_files_test
}  // namespace mocap::web
