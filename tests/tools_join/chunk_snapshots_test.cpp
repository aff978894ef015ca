#include "lib/join/chunk_snapshots.h"

#include <gtest/gtest.h>

#include "tools_join/joined_world.h"

namespace mocap::join {
namespace chunk_snapshots_test {

TEST(ChunkSnapshotsOfAPart, ComeInTheOrderOfTheirTimes) {
  const auto opened = open_chunks({ChunkedTake::shared().chunk(1), ChunkedTake::shared().chunk(2)});
  ASSERT_TRUE(opened) << opened.error().message;
  const retrack::Span overlap{opened->chunks[1].part.from, opened->chunks[0].part.to};
  ChunkSnapshots sets(opened->chunks[1], overlap);
  std::vector<std::uint64_t> numbers;

  for (auto set = sets.next(); set && *set; set = sets.next()) {
    EXPECT_TRUE(overlap.has(time_of(**set)));
    EXPECT_EQ(sets.description().version, (*set)->description_version());
    numbers.push_back((*set)->number());
  }

  ASSERT_EQ(numbers.size(), 90U) << "1.5 s";
  EXPECT_EQ(numbers.back(), ChunkedTake::kSets / 2 - 1);
  EXPECT_TRUE(std::ranges::is_sorted(numbers));
}

}  // namespace chunk_snapshots_test
}  // namespace mocap::join
