#include "take/take_writer.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/take_reader.h"

namespace mocap::take {
namespace take_writer_test {

TEST(TakeWriter, KeepsMessagesAndIndexIfTheTimecodeOfTheEndDoesNotFit) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "walk.mcap";
  TakeStart start = example_start();
  start.info.notes = std::string(kMaxInfo_bytes - 50, 'n');
  ASSERT_TRUE(check(start.info));
  TakeInfo end = start.info;
  end.ended_at = example_time(5);
  end.end_timecode = "10:00:05:00";
  ASSERT_FALSE(check(end));

  auto writer = TakeWriter::create(path, start);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE(append_example(**writer, 0, 5));
  EXPECT_TRUE((*writer)->finish(end));

  const auto reader = TakeReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_FALSE(reader->cut_off());
  EXPECT_EQ(read_example(*reader).snapshots.size(), 5U);
  EXPECT_EQ(reader->info().notes, start.info.notes);
  EXPECT_EQ(reader->info().ended_at, example_time(5));
}

}  // namespace take_writer_test
}  // namespace mocap::take
