#include "lib/takes/take_report.h"

#include <gtest/gtest.h>

#include "support/failing_folder.h"
#include "support/temporary_folder.h"

namespace mocap::takes {
namespace take_report_test {

TEST(TakesIn, AreThoseBeforeAFailureOfTheDisk) {
  const support::TemporaryFolder folder;
  for (const char* name : {"a.mcap", "b.mcap", "c.mcap", "d.mcap"}) folder.write(name, "");
  ASSERT_EQ(takes_in({folder.path()}).size(), 4U);

  const support::FailingFolder failing;
  std::size_t found = 4;
  EXPECT_NO_THROW(found = takes_in({folder.path()}).size());

  EXPECT_EQ(found, 1U);
}

}  // namespace take_report_test
}  // namespace mocap::takes
