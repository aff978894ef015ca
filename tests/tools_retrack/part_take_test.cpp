#include "lib/retrack/part_take.h"

#include <gmock/gmock.h>

#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::retrack {
namespace part_take_test {

TEST(PartTakeOfAnExample, HasItsNameOnceItIsWhole) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "walk.mcap";
  auto take = PartTake::create(path, take::example_start());
  ASSERT_TRUE(take) << take.error().message;
  ASSERT_TRUE(take->writer().append(take::example_snapshot(1)));
  EXPECT_FALSE(std::filesystem::exists(path));

  const auto written = take->finish(take::example_start().info);

  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(*written, path.string());
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(PartTakeOfAnExample, LeavesNothingIfItIsNotFinished) {
  const support::TemporaryFolder folder;
  { const auto take = PartTake::create(folder.path() / "walk.mcap", take::example_start()); }

  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace part_take_test
}  // namespace mocap::retrack
