#include "lib/join/seam.h"

#include <gtest/gtest.h>

#include "tools_join/joined_world.h"

namespace mocap::join {
namespace seam_test {

TEST(FindSeam, IsInTheMiddleOfTheSetsThatAgree) {
  const auto opened = open_chunks({ChunkedTake::shared().chunk(1), ChunkedTake::shared().chunk(2)});
  ASSERT_TRUE(opened) << opened.error().message;
  const retrack::Span overlap{opened->chunks[1].part.from, opened->chunks[0].part.to};

  const auto seam = find_seam(opened->chunks[0], opened->chunks[1], overlap);

  ASSERT_TRUE(seam) << seam.error().message;
  EXPECT_TRUE(seam->agrees);
  EXPECT_EQ(seam->differing_labels, 0);
  EXPECT_GT(seam->at, overlap.from + ChunkedTake::kOverlap / 2) << "the subject is found first";
  EXPECT_LT(seam->at, overlap.from + ChunkedTake::kOverlap * 7 / 10);
}

TEST(FindSeam, IsTheLastCommonSetWhereNoneAgrees) {
  const auto opened = open_chunks({ChunkedTake::shared().chunk(1), ChunkedTake::shared().chunk(2)});
  ASSERT_TRUE(opened) << opened.error().message;
  const Timestamp from = opened->chunks[1].part.from;

  const auto seam = find_seam(opened->chunks[0], opened->chunks[1], {from, from + std::chrono::milliseconds(40)});

  ASSERT_TRUE(seam) << seam.error().message;
  EXPECT_FALSE(seam->agrees) << "the subject is not found yet";
  EXPECT_GT(seam->at, from + std::chrono::milliseconds(20));
  EXPECT_LT(seam->at, from + std::chrono::milliseconds(40)) << "no set is at the end";
}

TEST(FindSeam, IsTheEndOfAnOverlapWithoutCommonSets) {
  const auto opened = open_chunks({ChunkedTake::shared().chunk(1), ChunkedTake::shared().chunk(2)});
  ASSERT_TRUE(opened) << opened.error().message;
  const Timestamp at = opened->chunks[1].part.from + std::chrono::microseconds(100);

  const auto seam = find_seam(opened->chunks[0], opened->chunks[1], {at, at + Duration(1)});

  ASSERT_TRUE(seam) << seam.error().message;
  EXPECT_FALSE(seam->agrees);
  EXPECT_EQ(seam->at, at + Duration(1));
}

}  // namespace seam_test
}  // namespace mocap::join
