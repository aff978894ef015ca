#include "lib/takes/take_report.h"

#include <gtest/gtest.h>

#include "support/failing_folder.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::takes {
namespace take_report_test {

TEST(QualityOf, ATakeWithDeepFiguresIsMeasured) {
  const support::TemporaryFolder folder;
  take::TakeStart start = take::example_start();
  start.info.others["quality_figures"] = R"({"a":)" + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "}";
  auto writer = take::TakeWriter::create(folder.path() / "walk.mcap", start);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE((*writer)->finish(start.info));
  const auto reader = take::TakeReader::open(folder.path() / "walk.mcap");
  ASSERT_TRUE(reader) << reader.error().message;

  const std::string text = quality_of(*reader).dump();

  EXPECT_NE(text.find("sets"), std::string::npos);
}

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
