#include "take/recorder/shot_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "support/temporary_folder.h"

namespace mocap::take {
namespace shot_list_test {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string fault(const std::string& csv) {
  const auto shots = parse_shots(csv, "day.csv");
  return shots ? std::string() : shots.error().message;
}

TEST(Shots, AreReadFromCsv) {
  const auto shots = parse_shots(
      "\xEF\xBB\xBFname, slate ,notes,seconds\r\nwalk_1,A12,\"slow, then \"\"run\"\"\",12.5\r\n\r\nfall\r\n",
      "day.csv");

  ASSERT_TRUE(shots) << shots.error().message;
  ASSERT_EQ(shots->size(), 2U);
  EXPECT_EQ((*shots)[0], (Shot{"walk_1", "A12", "slow, then \"run\"", std::chrono::milliseconds(12500), false}));
  EXPECT_EQ((*shots)[1], (Shot{"fall", "", "", {}, false}));
}

TEST(Shots, HaveColumnsInAnyOrder) {
  const auto shots = parse_shots("seconds,name\n3,walk\n", "day.csv");

  ASSERT_TRUE(shots);
  EXPECT_EQ((*shots)[0].name, "walk");
  EXPECT_EQ((*shots)[0].length, std::chrono::seconds(3));
}

TEST(Shots, NameFileAndLineOfAFault) {
  EXPECT_THAT(fault(""), StartsWith("day.csv:1: the file is empty"));
  EXPECT_THAT(fault("walk\nrun\n"), StartsWith("day.csv:1: unknown column 'walk'"));
  EXPECT_THAT(fault("name;slate\n"), HasSubstr("with commas between"));
  EXPECT_THAT(fault("slate\n"), StartsWith("day.csv:1: the header has no column 'name'"));
  EXPECT_THAT(fault("name,name\n"), StartsWith("day.csv:1: column 'name' occurs twice"));
  EXPECT_THAT(fault("name\nwalk\na,b\n"), StartsWith("day.csv:3: the line has 2 cells, the header 1"));
  EXPECT_THAT(fault("name,seconds\nwalk,soon\n"), StartsWith("day.csv:2: seconds is 'soon', expected 0 to 604800"));
  EXPECT_THAT(fault("name,seconds\nwalk,-1\n"), StartsWith("day.csv:2: seconds is '-1'"));
  EXPECT_THAT(fault("name\n../walk\n"), StartsWith("day.csv:2: name is '../walk'"));
  EXPECT_THAT(fault("name,notes\nwalk,\"two\nlines\"\nwalk,\n"),
              StartsWith("day.csv:4: name 'walk' is in line 2 already"));
  EXPECT_THAT(fault("name,notes\nwalk,\"open\n"), HasSubstr("a quote is not closed"));
  EXPECT_THAT(fault("name\n\"walk\"x\n"), HasSubstr("day.csv:2: expected a comma after the closing quote"));
  std::string long_list = "name\n";
  for (int i = 0; i < 501; ++i) long_list += "shot" + std::to_string(i) + "\n";
  EXPECT_THAT(fault(long_list), HasSubstr("501 shots"));
}

TEST(Shots, HaveNotesThatATakeAccepts) {
  const auto shots = parse_shots("name,notes\nwalk,\"\x01 slow\tthen\r\nrun\rand\x7Fstop\t\"\n", "day.csv");

  ASSERT_TRUE(shots) << shots.error().message;
  TakeInfo info;
  info.notes = shots->front().notes;
  EXPECT_TRUE(check(info));
  EXPECT_EQ(info.notes, "slow then\nrun and stop");
}

TEST(Shots, NameTheLineOfNotesThatLeaveNoSpaceForTimecodes) {
  const std::string longest(kMaxShotNotes_bytes, 'n');

  EXPECT_EQ(fault("name,notes\nrun,\nwalk," + longest + "\n"), "");
  EXPECT_EQ(fault("name,notes\nrun,\nwalk," + longest + "n\n"),
            "day.csv:3: notes has 11265 bytes, expected at most 11264");
}

TEST(Shots, SurviveRandomText) {
  std::mt19937 random(3);
  const std::string alphabet = "name,slate\n\r\t\"a1\xC3";
  for (int round = 0; round < 20'000; ++round) {
    std::string csv = round % 2 == 0 ? "name,notes\n" : "";
    for (auto i = random() % 40; i > 0; --i) csv += alphabet[random() % alphabet.size()];
    if (const auto shots = parse_shots(csv, "x")) {
      const auto again = parse_shots(shots_csv(*shots), "x");
      ASSERT_TRUE(again) << csv << again.error().message;
      ASSERT_EQ(*again, *shots) << csv;
    }
  }
}

TEST(ShotList, GivesEveryShotOnceAndSurvivesARestart) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "state" / "shot_list.csv";
  ShotList list(path);
  ASSERT_TRUE(list.load());
  EXPECT_EQ(list.next(), nullptr);
  ASSERT_TRUE(list.replace({{"a", "A", "first", std::chrono::seconds(5)}, {"b", "", "", {}}, {"c", "", "", {}}}));
  EXPECT_EQ(list.next()->name, "a");
  ASSERT_TRUE(list.set_done("a", true));
  ASSERT_TRUE(list.set_done("b", true));
  ASSERT_TRUE(list.set_done("b", false));

  ShotList later(path);
  ASSERT_TRUE(later.load());
  EXPECT_EQ(later.next()->name, "b");
  EXPECT_EQ(later.left(), 2U);
  EXPECT_EQ(later.shots()[0], (Shot{"a", "A", "first", std::chrono::seconds(5), true}));
}

TEST(ShotList, KeepsItsShotsIfANewListIsRefused) {
  const support::TemporaryFolder folder;
  ShotList list(folder.path() / "shot_list.csv");
  ASSERT_TRUE(list.replace({{"a", "", "", {}}}));

  EXPECT_FALSE(list.replace({{"b", "", "", {}}, {"b", "", "", {}}}));
  EXPECT_EQ(list.shots().size(), 1U);
}

TEST(ShotList, RefusesNotesThatNoTakeAccepts) {
  const support::TemporaryFolder folder;
  ShotList list(folder.path() / "shot_list.csv");

  const Status tab = list.replace({{"a", "", "slow\tthen run", {}}});
  const Status size = list.replace({{"a", "", std::string(kMaxShotNotes_bytes + 1, 'n'), {}}});

  ASSERT_FALSE(tab);
  EXPECT_THAT(tab.error().message, StartsWith("shot 'a': notes has control characters"));
  ASSERT_FALSE(size);
  EXPECT_THAT(size.error().message, StartsWith("shot 'a': notes has 11265 bytes"));
}

TEST(ShotList, NamesTheLineOfADamagedFile) {
  const support::TemporaryFolder folder;
  ShotList list(folder.write("shot_list.csv", "name\na/b\n"));

  const Status loaded = list.load();
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, HasSubstr("shot_list.csv:2: "));
  EXPECT_TRUE(list.shots().empty());
}

TEST(ShotList, TellsThatItsFileCannotBeRead) {
  ShotList list("/proc/self/mem");  // its first read fails with EIO

  const Status loaded = list.load();
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, HasSubstr("Input/output error"));
}

}  // namespace shot_list_test
}  // namespace mocap::take
