#include "lib/retrack/chunk.h"

#include <gmock/gmock.h>

namespace mocap::retrack {
namespace chunk_test {

using ::testing::HasSubstr;

TEST(ParseChunk, ReadsItsNumberAndTheNumberOfAll) {
  const auto chunk = parse_chunk("3/8");

  ASSERT_TRUE(chunk) << chunk.error().message;
  EXPECT_EQ(chunk->number, 3U);
  EXPECT_EQ(chunk->of, 8U);
  EXPECT_EQ(to_text(*chunk), "3/8");
}

TEST(ParseChunk, RefusesWhatIsNoChunk) {
  for (const char* text : {"", "3", "/", "3/", "/8", "0/8", "9/8", "-1/8", "3/8x", " 3/8", "1/1001", "1/99999999999"}) {
    const auto chunk = parse_chunk(text);

    ASSERT_FALSE(chunk) << text;
    EXPECT_THAT(chunk.error().message, HasSubstr("expected NUMBER/ALL, such as 3/8")) << text;
  }
}

TEST(ChunkOriginText, IsReadBack) {
  const auto origin = parse_origin(to_text(ChunkOrigin{{.number = 3, .of = 8}, "abc of def"}));

  ASSERT_TRUE(origin) << origin.error().message;
  EXPECT_EQ(origin->chunk.number, 3U);
  EXPECT_EQ(origin->digest, "abc of def");
  for (const char* text : {"", "0123abcd", "chunk 3/8", "chunk 9/8 of abc"}) EXPECT_FALSE(parse_origin(text)) << text;
}

TEST(ChunkFile, IsInAFolderBesideTheNewTake) {
  EXPECT_EQ(chunk_file("/new/walk.mcap", {.number = 3, .of = 8}), "/new/walk.chunks/3-of-8.mcap");
  EXPECT_EQ(chunk_folder("walk.mcap"), "walk.chunks");
}

TEST(SpanOfAChunk, CoversTheTakeWithOverlaps) {
  const Timestamp first = from_ns(1'000), last = from_ns(11'001);
  const Duration overlap(100);

  const Span one = span_of({1, 3, overlap}, first, last), two = span_of({2, 3, overlap}, first, last),
             three = span_of({3, 3, overlap}, first, last);

  EXPECT_EQ(one.from, Timestamp::min());
  EXPECT_EQ(one.to, from_ns(4'333));
  EXPECT_EQ(two.from, one.to - overlap);
  EXPECT_EQ(two.to, from_ns(7'667));
  EXPECT_EQ(three.from, two.to - overlap);
  EXPECT_EQ(three.to, Timestamp::max());
}

}  // namespace chunk_test
}  // namespace mocap::retrack
