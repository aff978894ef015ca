#include "settings/toml/suggestion.h"

#include <gtest/gtest.h>

namespace mocap::settings {
namespace suggestion_test {

TEST(EditDistance, CountsTypingErrors) {
  EXPECT_EQ(edit_distance("threshold", "threshold"), 0U);
  EXPECT_EQ(edit_distance("treshold", "threshold"), 1U);    // left out
  EXPECT_EQ(edit_distance("thrreshold", "threshold"), 1U);  // twice
  EXPECT_EQ(edit_distance("threshald", "threshold"), 1U);   // another
  EXPECT_EQ(edit_distance("htreshold", "threshold"), 1U);   // swapped
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);  // the example of textbooks
}

TEST(NearestWord, IsTheMostSimilarWord) {
  const std::vector<std::string> known{"window_us", "patience_us", "wait"};

  EXPECT_EQ(nearest_word("windw_us", known), "window_us");
  EXPECT_EQ(nearest_word("Wait", known), "wait");
}

TEST(NearestWord, IsEmptyIfNoWordIsSimilar) {
  EXPECT_EQ(nearest_word("colour", {"window_us", "wait"}), std::nullopt);
  EXPECT_EQ(nearest_word("x", {}), std::nullopt);
}

}  // namespace suggestion_test
}  // namespace mocap::settings
