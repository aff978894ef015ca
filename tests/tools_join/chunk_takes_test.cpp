#include "lib/join/chunk_takes.h"

#include <gmock/gmock.h>

#include "take/take_edit.h"
#include "tools_join/joined_world.h"

namespace mocap::join {
namespace chunk_takes_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(OpenChunks, SortsThemAndKnowsTheirParts) {
  const ChunkedTake& take = ChunkedTake::shared();

  const auto opened = open_chunks({take.chunk(2), take.chunk(1)});

  ASSERT_TRUE(opened) << opened.error().message;
  ASSERT_EQ(opened->chunks.size(), 2U);
  EXPECT_EQ(opened->chunks[0].part.from, Timestamp::min());
  EXPECT_EQ(opened->chunks[1].part.from, opened->chunks[0].part.to - ChunkedTake::kOverlap);
  EXPECT_EQ(opened->chunks[1].part.to, Timestamp::max());
  EXPECT_EQ(opened->made_of.size(), 64U);
}

TEST(OpenChunks, RefusesChunksThatAreNoWholeTake) {
  const ChunkedTake& take = ChunkedTake::shared();

  const auto none = open_chunks({}), missing = open_chunks({take.chunk(1)});
  const auto twice = open_chunks({take.chunk(1), take.chunk(2), take.chunk(2)});
  const auto no_chunk = open_chunks({take.chunk(1), take.whole()}), absent = open_chunks({take.folder() / "x.mcap"});

  EXPECT_FALSE(none);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("chunk 2/2 of this take is missing"));
  ASSERT_FALSE(twice);
  EXPECT_THAT(twice.error().message, HasSubstr("is chunk 2/2, as "));
  ASSERT_FALSE(no_chunk);
  EXPECT_THAT(no_chunk.error().message, AllOf(HasSubstr("whole.mcap"), HasSubstr("is no chunk")));
  ASSERT_FALSE(absent);
  EXPECT_EQ(absent.error().code, ErrorCode::NotFound);
}

TEST(OpenChunks, RefusesChunksOfOtherOrders) {
  const ChunkedTake& take = ChunkedTake::shared();
  const std::filesystem::path other = take.folder() / "other.mcap";
  const Chunk chunk{.number = 2, .of = 2, .overlap = ChunkedTake::kOverlap};
  ChunkedTake::track({.take = take.recorded(), .out = other, .chunk = chunk, .offline = true});

  const auto mixed = open_chunks({take.chunk(1), retrack::chunk_file(other, chunk)});

  ASSERT_FALSE(mixed);
  EXPECT_THAT(mixed.error().message, HasSubstr("was not made of the same take with the same settings"));
}

TEST(OpenChunks, RefusesAChunkThatIsCutOff) {
  const ChunkedTake& take = ChunkedTake::shared();
  const std::filesystem::path cut = take.folder() / "cut.mcap";
  std::filesystem::copy_file(take.chunk(2), cut);
  std::filesystem::resize_file(cut, std::filesystem::file_size(cut) / 2);

  const auto refused = open_chunks({take.chunk(1), cut});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, AllOf(HasSubstr("cut.mcap"), HasSubstr("track this chunk again")));
}

// The repair of a chunk that was cut off makes a whole file of a part of the chunk.
TEST(OpenChunks, RefusesAChunkThatWasRepaired) {
  const ChunkedTake& take = ChunkedTake::shared();
  const std::filesystem::path repaired = take.folder() / "repaired.mcap";
  std::filesystem::copy_file(take.chunk(2), repaired);
  std::filesystem::resize_file(repaired, std::filesystem::file_size(repaired) / 2);
  const auto mended = take::repair_take(repaired);
  ASSERT_TRUE(mended) << mended.error().message;

  const auto refused = open_chunks({take.chunk(1), repaired});

  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, AllOf(HasSubstr("repaired.mcap"), HasSubstr("track this chunk again")));
}

TEST(MadeOf, IsKnownFromTheChunksThatAreLeft) {
  const ChunkedTake& take = ChunkedTake::shared();
  const auto all = open_chunks({take.chunk(1), take.chunk(2)});
  ASSERT_TRUE(all) << all.error().message;

  const auto left = made_of({take.chunk(2)});

  ASSERT_TRUE(left) << left.error().message;
  EXPECT_EQ(*left, all->made_of);
}

}  // namespace chunk_takes_test
}  // namespace mocap::join
