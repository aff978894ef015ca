#include <gtest/gtest.h>

#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/mcap/encode_records.h"
#include "take/take_reader.h"

namespace mocap::take {
namespace take_cursor_test {

TEST(TakeCursor, LeavesOutAnUnselectedChannelOfTheLargestId) {
  const support::TemporaryFolder folder;
  std::string take(mcap::kMagic);
  mcap::encode(mcap::Header{"mocap", "crafted"}, take);
  mcap::encode(encode(example_start().info), take);
  mcap::encode(mcap::Channel{0xFFFF, 0, std::string(kHealthTopic), "protobuf", {}}, take);
  mcap::encode(mcap::Message{0xFFFF, 0, 1, 1, "unselected"}, take);
  const auto reader = TakeReader::open(folder.write("crafted.mcap", take));
  ASSERT_TRUE(reader) << reader.error().message;

  TakeCursor cursor = reader->messages({{TakeTopic::Blobs}, {}, {}, "camera0"});
  const auto record = cursor.next();

  ASSERT_TRUE(record) << record.error().message;
  EXPECT_FALSE(*record);
}

}  // namespace take_cursor_test
}  // namespace mocap::take
