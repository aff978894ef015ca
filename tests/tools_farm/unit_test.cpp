#include "lib/farm/unit.h"

#include <gmock/gmock.h>

#include <csignal>

#include "support/temporary_folder.h"

namespace mocap::farm {
namespace unit_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(MakeUnits, GivesEachTakeANewOneOfItsNameInTheFolder) {
  const support::TemporaryFolder folder;
  folder.write("takes/b.mcap", "four");
  folder.write("takes/a.mcap", "");
  folder.write("takes/.c.part.mcap", "not whole");
  folder.write("takes/notes.txt", "");

  const auto units = make_units({folder.path() / "takes"}, folder.path() / "new" / "again");

  ASSERT_TRUE(units) << units.error().message;
  ASSERT_EQ(units->size(), 2U);
  EXPECT_EQ((*units)[0].take, folder.path() / "takes/a.mcap");
  EXPECT_EQ((*units)[1].out, folder.path() / "new/again/b.mcap");
  EXPECT_EQ((*units)[1].bytes, 4U);
  EXPECT_TRUE(std::filesystem::is_directory(folder.path() / "new/again"));
}

TEST(MakeUnits, WithoutAFolderTheNewTakesAreInTheCurrentOne) {
  const auto units = make_units({"/takes/walk.mcap"}, {});

  ASSERT_TRUE(units);
  EXPECT_EQ(units->front().out, std::filesystem::current_path() / "walk-retracked.mcap");
}

TEST(MakeUnits, TakesATakeThatIsNamedTwiceOnce) {
  const support::TemporaryFolder folder;
  const auto take = folder.write("a.mcap", "");

  const auto units = make_units({take, take}, folder.path() / "new");

  ASSERT_TRUE(units);
  EXPECT_EQ(units->size(), 1U);
}

TEST(MakeUnits, RefusesTwoTakesOfOneNameAndNone) {
  const support::TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "empty");

  const auto two = make_units({"one/walk.mcap", "two/walk.mcap"}, folder.path() / "new");
  const auto none = make_units({folder.path() / "empty"}, folder.path() / "new");

  ASSERT_FALSE(two);
  EXPECT_THAT(two.error().message, AllOf(HasSubstr("one/walk.mcap"), HasSubstr("two/walk.mcap")));
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().message, HasSubstr("no take"));
}

TEST(CommandOf, HasTheOptionsOfAllUnits) {
  const Unit unit{"/takes/a b.mcap", "/new/a b.mcap"};

  EXPECT_THAT(command_of({"/usr/bin/mocapctl", {"--rig", "/rig.toml"}}, unit),
              ElementsAre("/usr/bin/mocapctl", "take", "retrack", "/takes/a b.mcap", "--out", "/new/a b.mcap", "--rig",
                          "/rig.toml", "--json"));
}

TEST(InChunks, GivesEachTakeItsChunks) {
  const auto parts = in_chunks({{"/takes/a.mcap", "/new/a.mcap", 900}, {"/takes/b.mcap", "/new/b.mcap", 30}}, 3);

  ASSERT_EQ(parts.size(), 6U);
  EXPECT_EQ(parts[4].take, "/takes/b.mcap");
  EXPECT_EQ(file_of(parts[4]), "/new/b.chunks/2-of-3.mcap");
  EXPECT_EQ(parts[4].bytes, 10U);
  EXPECT_THAT(command_of({"/usr/bin/mocapctl", {}}, parts[4]),
              ElementsAre("/usr/bin/mocapctl", "take", "retrack", "/takes/b.mcap", "--out", "/new/b.mcap", "--chunk",
                          "2/3", "--json"));
  EXPECT_EQ(file_of({"/takes/a.mcap", "/new/a.mcap"}), "/new/a.mcap");
}

TEST(JoinCommand, JoinsTheChunksOfANewTake) {
  EXPECT_THAT(
      join_command("/usr/bin/mocapctl", "/new/a.mcap", 8),
      ElementsAre("/usr/bin/mocapctl", "take", "join", "/new/a.mcap", "--chunks", "8", "--remove-chunks", "--resume"));
}

TEST(UnitOutput, KnowsTheProgressAndTheReport) {
  UnitOutput output;
  output.add("progress 0.25");
  EXPECT_EQ(output.share(), 0.25);
  output.add("progress 7");
  EXPECT_EQ(output.share(), 1.0);
  output.add(R"({"file": "a.mcap", "sets": 12, "kept": false})");

  const UnitResult result = output.result({});

  EXPECT_EQ(result.kind, UnitResult::Kind::Tracked);
  EXPECT_EQ(result.report.at("sets"), 12);
  output.add(R"({"kept": true})");
  EXPECT_EQ(output.result({}).kind, UnitResult::Kind::Kept);
}

TEST(UnitOutput, TellsTheReasonOfAFailure) {
  UnitOutput output;
  output.add("mocapctl: 'a.mcap' has no images");

  const UnitResult refused = output.result({.exit_code = 65}), killed = output.result({.signal = SIGKILL});
  const UnitResult silent = UnitOutput().result({.exit_code = 70}), no_report = UnitOutput().result({});

  EXPECT_EQ(refused.kind, UnitResult::Kind::Failed);
  EXPECT_EQ(refused.exit_code, 65);
  EXPECT_EQ(refused.reason, "'a.mcap' has no images");
  EXPECT_THAT(killed.reason, HasSubstr("signal 9"));
  EXPECT_NE(killed.exit_code, 0);
  EXPECT_EQ(silent.reason, "exit code 70");
  EXPECT_EQ(no_report.kind, UnitResult::Kind::Failed);
  EXPECT_NE(no_report.exit_code, 0);
}

TEST(UnitOutput, IsBounded) {
  UnitOutput output;
  for (int i = 0; i < 1000; ++i) output.add(std::string(1000, 'x'));

  EXPECT_LT(output.result({.exit_code = 1}).reason.size(), 8000U);
}

}  // namespace unit_test
}  // namespace mocap::farm
