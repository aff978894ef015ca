#include "take/recorder/take_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::take {
namespace take_folder_test {

using ::testing::HasSubstr;

class TakeFolderTest : public ::testing::Test {
 protected:
  TakeFolderTest() {
    settings_.folder = root_.path() / "takes";
    settings_.min_free_mb = 0;
  }

  support::TemporaryFolder root_;
  TakesSettings settings_;
  TakeFolder folder_{settings_};
};

TEST_F(TakeFolderTest, RefusesAnOrderWithANameThatExistsAndNamesTheNextFreeOne) {
  root_.write("takes/walk.mcap", "");

  EXPECT_TRUE(folder_.check_order({.name = "run"}));
  EXPECT_THAT(folder_.check_order({.name = "walk"}).error().message, HasSubstr("the next free name is 'walk-2'"));
  EXPECT_FALSE(folder_.check_order({.slate = "a/b"}));
  EXPECT_THAT(folder_.check_order({.before = std::chrono::seconds(31)}).error().message, HasSubstr("before_s = 30"));
}

TEST_F(TakeFolderTest, IsMadeAndHasItsLeastFreeSpace) {
  EXPECT_TRUE(folder_.prepare());
  EXPECT_TRUE(std::filesystem::is_directory(settings_.folder));

  settings_.min_free_mb = 1'000'000'000;
  EXPECT_THAT(folder_.prepare().error().message, HasSubstr("min_free_mb = 1000000000"));
  EXPECT_EQ(folder_.check_space().error().code, ErrorCode::Io);
}

TEST_F(TakeFolderTest, CannotBeMadeWithinAFile) {
  settings_.folder = root_.write("file", "") / "takes";

  EXPECT_THAT(folder_.prepare().error().message, HasSubstr("cannot be made"));
}

TEST_F(TakeFolderTest, NamesATakeByItsOrderOrByThePattern) {
  root_.write("takes/walk_004.mcap", "");

  EXPECT_EQ(folder_.name_for({.name = "run"}, "walk", {}).name, "run");
  const TakeName next = folder_.name_for({}, "walk", {});
  EXPECT_EQ(next.name, "walk_005");
  EXPECT_EQ(next.number, 5U);
}

TEST_F(TakeFolderTest, GivesAnOrderWhatTheShotSays) {
  const Shot shot{.name = "opening", .slate = "12A", .notes = "slow", .length = std::chrono::seconds(7)};

  const TakeOrder first = folder_.with_shot({}, shot);
  EXPECT_EQ(first.name, "opening");
  EXPECT_EQ(first.slate, "12A");
  EXPECT_EQ(first.text, "slow");
  EXPECT_EQ(first.length, std::chrono::seconds(7));

  root_.write("takes/opening.mcap", "");
  const TakeOrder again = folder_.with_shot({.slate = "13"}, shot);
  EXPECT_EQ(again.name, "opening-2");
  EXPECT_EQ(again.slate, "13");
}

TEST_F(TakeFolderTest, NoticesThatAFileIsGone) {
  const std::filesystem::path file = root_.write("takes/walk.mcap", "");
  EXPECT_TRUE(check_file(file.string()));

  std::filesystem::remove(file);
  EXPECT_THAT(check_file(file.string()).error().message, HasSubstr("is gone"));
}

}  // namespace take_folder_test
}  // namespace mocap::take
