#include "detect/kernels/bright_words.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <vector>

namespace mocap::detect {
namespace bright_words_test {

TEST(WordPlaces, GiveEachWordOfAnImageItsOwnPlaceInTheOrderOfRows) {
  for (const int width_px : {1, 63, 64, 65, 1280}) {
    const WordPlaces places(width_px);
    std::uint32_t last = 0;
    for (int y = 0; y < 20; ++y) {
      for (int word = 0; word < words_of(width_px); ++word) {
        const BrightWord bright{1, places.of(y, word)};

        EXPECT_TRUE((y == 0 && word == 0) || bright.place > last);
        EXPECT_EQ(places.y(bright), y);
        EXPECT_EQ(places.x(bright, y), 64 * word);
        last = bright.place;
      }
      // Two words beyond a row are no words of the next row.
      EXPECT_GT(places.of(y + 1, 0), last + 2);
    }
  }
}

TEST(BrightWord, CountsEachRunOfARowOnce) {
  std::mt19937_64 random(9);
  for (int trial = 0; trial < 200; ++trial) {
    constexpr int kWords = 4;
    const WordPlaces places(64 * kWords);
    std::vector<std::uint64_t> row(kWords);
    for (std::uint64_t& word : row) word = trial % 3 == 0 ? random() | random() | random() : random() & random();
    if (trial % 5 == 0) row[2] = 0;

    std::size_t runs = 0;
    BrightWord last{0, places.of(6, kWords - 1)};
    for (int word = 0; word < kWords; ++word) {
      if (row[static_cast<std::size_t>(word)] == 0) continue;  // only bright words are kept
      const BrightWord next{row[static_cast<std::size_t>(word)], places.of(7, word)};
      runs += runs_begun(last, next);
      last = next;
    }

    std::size_t expected = 0;
    bool was_bright = false;
    for (int x = 0; x < 64 * kWords; ++x) {
      const bool is_bright = (row[static_cast<std::size_t>(x / 64)] >> (x % 64) & 1U) != 0;
      expected += is_bright && !was_bright ? 1 : 0;
      was_bright = is_bright;
    }
    EXPECT_EQ(runs, expected);
  }
}

TEST(BrightWord, ContinuesNoRunOfTheRowAbove) {
  const WordPlaces places(64);
  const BrightWord end_of_row{1ULL << 63U, places.of(3, 0)};
  const BrightWord next_row{1, places.of(4, 0)};

  EXPECT_EQ(runs_begun(end_of_row, next_row), 1U);
}

TEST(BrightWords, HaveRoomForAWhiteImageInFourParts) {
  for (const int height_px : {1, 3, 4, 5, 6, 17, 1024}) {
    constexpr int kWidth_px = 130;
    std::vector<BrightWord> room(BrightWords::room_for(kWidth_px, height_px));
    BrightWords words(room, kWidth_px, height_px);
    for (int y = 0; y < height_px; ++y) {
      BrightWord*& end = words.end(words.part_of(y));
      const BrightWord* const begin = end;
      for (int word = 0; word < words_of(kWidth_px); ++word) *end++ = {~0ULL, words.places().of(y, word)};
      words.count_row(begin, end);
    }

    std::set<std::uint32_t> places;
    for (int part = 0; part < BrightWords::kParts; ++part) {
      for (const BrightWord& word : words.part(part)) {
        EXPECT_EQ(words.part_of(words.places().y(word)), part);
        EXPECT_TRUE(places.insert(word.place).second) << "overwritten by another part";
        EXPECT_GE(&word, room.data());
        EXPECT_LT(&word, room.data() + room.size());
      }
    }
    EXPECT_EQ(places.size(), static_cast<std::size_t>(height_px) * 3);
    EXPECT_EQ(words.max_words_in_row(), 3U);
    words.clear();
    for (int part = 0; part < BrightWords::kParts; ++part) EXPECT_TRUE(words.part(part).empty());
    EXPECT_EQ(words.max_words_in_row(), 0U);
  }
}

}  // namespace bright_words_test
}  // namespace mocap::detect
