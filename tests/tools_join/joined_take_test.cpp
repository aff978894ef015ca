#include "lib/join/joined_take.h"

#include <gtest/gtest.h>

#include "lib/join/chunk_snapshots.h"
#include "tools_join/joined_world.h"

namespace mocap::join {
namespace joined_take_test {

TEST(JoinedTakeOfChunks, HasEachImageOnceAndDescriptionsOfRisingVersions) {
  const ChunkedTake& take = ChunkedTake::shared();
  const auto opened = open_chunks({take.chunk(1), take.chunk(2)});
  ASSERT_TRUE(opened) << opened.error().message;
  const std::filesystem::path path = take.folder() / "by_hand.mcap";
  auto joined = JoinedTake::create(path, *opened);
  ASSERT_TRUE(joined) << joined.error().message;
  ChunkSnapshots first(opened->chunks[0], {}), second(opened->chunks[1], {});

  for (auto set = first.next(); set && *set; set = first.next()) {
    ASSERT_TRUE(joined->append(**set, 0, first.description()));
  }
  std::optional<v1::Snapshot> last;
  for (auto set = second.next(); set && *set; set = second.next()) last = **set;
  ASSERT_TRUE(last);
  ASSERT_TRUE(joined->append(*last, 1, second.description()));
  ASSERT_TRUE(joined->finish());

  const auto reader = take::TakeReader::open(path);
  ASSERT_TRUE(reader) << reader.error().message;
  EXPECT_EQ(reader->counts().at("blobs/cam1"), ChunkedTake::kSets);
  EXPECT_EQ(reader->info().name, "by_hand");
  EXPECT_EQ(reader->files(), take::TakeReader::open(take.recorded())->files());
  const std::vector<v1::Snapshot> written = messages_in(path);
  const std::uint32_t of_first = messages_in(take.chunk(1)).back().description_version();
  EXPECT_GT(of_first, 1U) << "a body was fitted";
  EXPECT_EQ(written.back().description_version(), of_first + 1);
}

}  // namespace joined_take_test
}  // namespace mocap::join
