#include "corpus/table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::corpus {
namespace table_test {

using ::testing::HasSubstr;

const Figures kFigures{88, 1500, 3, 380, 1, 0.25, 87, 40, 0xFEDCBA9876543210U, ""};

TEST(CorpusTable, ReadsBackWhatWasWritten) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(write_table(folder.path() / "t.tsv", {"a new tracker", {{"calm-1", kFigures}}}));

  const auto read = read_table(folder.path() / "t.tsv");

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->reason, "a new tracker");
  const Figures& row = read->figures.at("calm-1");
  EXPECT_EQ(difference(kFigures, row), "");
  EXPECT_EQ(row.hash, kFigures.hash);
}

TEST(CorpusTable, NamesTheLineOfAFault) {
  const support::TemporaryFolder folder;

  const auto read = read_table(folder.write("t.tsv", "# a\nname\t1\t2\n"));

  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("t.tsv:2: expected"));
}

TEST(CorpusTable, AllowsWhatRoundingExplainsAndNoMore) {
  Figures near = kFigures;
  near.labels += 18;
  near.rms += 0.005;
  near.hash = 1;
  EXPECT_EQ(difference(kFigures, near), "");

  Figures far = kFigures;
  far.sets -= 3;
  far.wrong += 4;
  EXPECT_THAT(difference(kFigures, far), HasSubstr("sets 85, frozen 88"));
  EXPECT_THAT(difference(kFigures, far), HasSubstr("wrong 5, frozen 1"));
  Figures faulty = kFigures;
  faulty.fault = "a take has no end";
  EXPECT_THAT(difference(kFigures, faulty), HasSubstr("a take has no end"));
}

}  // namespace table_test
}  // namespace mocap::corpus
