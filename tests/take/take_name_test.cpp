#include "take/take_name.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace mocap::take {
namespace take_name_test {

// 2026-03-01 12:34:56 UTC.
constexpr Duration kNoon = std::chrono::seconds(1772368496);

class TakeNames : public testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() / ("mocap-names-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  void have(const std::string& name) const { std::ofstream(folder / (name + ".mcap")) << "x"; }

  std::filesystem::path folder;
};

TEST_F(TakeNames, CountFromOneInAFolderThatDoesNotExist) {
  const TakeName next = next_name(folder / "none", "{slate}_{number}", "walk", kNoon);

  EXPECT_EQ(next.name, "walk_001");
  EXPECT_EQ(next.number, 1U);
}

TEST_F(TakeNames, CountOnFromTheLargestNumberOfTheSlate) {
  for (const char* name : {"walk_001", "walk_7", "run_012", "walk_x", "walk_9b"}) have(name);

  EXPECT_EQ(next_name(folder, "{slate}_{number}", "walk", kNoon).name, "walk_008");
  EXPECT_EQ(next_name(folder, "{slate}_{number}", "run", kNoon).name, "run_013");
}

TEST_F(TakeNames, HaveDateAndTimeInUtc) {
  EXPECT_EQ(next_name(folder, "{date}-{time}-{slate}-{number}", "walk", kNoon).name, "2026-03-01-123456-walk-001");
}

TEST_F(TakeNames, ASlateWithBracesIsTakenAsItIs) {
  have("{number}_001");

  EXPECT_EQ(next_name(folder, "{slate}_{number}", "{number}", kNoon).name, "{number}_002");
}

TEST_F(TakeNames, NameTheNextFreeOne) {
  have("walk");
  have("walk-2");

  EXPECT_TRUE(has_take(folder, "walk"));
  EXPECT_EQ(free_name(folder, "walk"), "walk-3");
}

TEST_F(TakeNames, ThatLeaveTheFolderAreRefused) {
  for (const char* name : {"", "a/b", "../a", ".a", "-a", "a\nb", "a\\b"})
    EXPECT_FALSE(check_name(name, "name")) << name;
  EXPECT_TRUE(check_name("Szene 3 äöü", "name"));
  for (const char* pattern : {"{slate}", "{number}{number}", "{x}_{number}", "a/{number}", "{number"}) {
    EXPECT_FALSE(check_pattern(pattern)) << pattern;
  }
  EXPECT_TRUE(check_pattern("{date}_{slate}_{number}"));
}

}  // namespace take_name_test
}  // namespace mocap::take
