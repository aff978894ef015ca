#include "lib/cli/shown_text.h"

#include <gtest/gtest.h>

#include <string>

namespace mocap::cli {
namespace shown_text_test {

TEST(Shown, HasNoControlCharacters) {
  EXPECT_EQ(shown("a\x1b[2Jb\nc\x7f"
                  "d"),
            "a [2Jb c d");
  EXPECT_EQ(shown("a\u009b2Jb"), "a 2Jb");
}

TEST(Shown, KeepsOtherText) {
  EXPECT_EQ(shown("J\u00fcrgen \u20ac \u00c2"), "J\u00fcrgen \u20ac \u00c2");
  EXPECT_EQ(shown(""), "");
}

TEST(ShownLines, KeepsTheLinesOfAMessage) {
  EXPECT_EQ(shown_lines("2 faults\n  a\x1b[2J\n  b"), "2 faults\n  a [2J\n  b");
  EXPECT_EQ(shown_lines("one\n"), "one\n");
  EXPECT_EQ(shown_lines(""), "");
}

TEST(Shown, IsCutBetweenTwoCharacters) {
  EXPECT_EQ(shown("J\u00fcrgen", 3), "J\u00fc");
  EXPECT_EQ(shown("J\u00fcrgen", 2), "J");
  EXPECT_EQ(shown("J\u00fcrgen", 1), "J");
  EXPECT_EQ(shown("J\u00fcrgen", 0), "");
  EXPECT_EQ(shown("J\u00fcrgen", 7), "J\u00fcrgen");
}

}  // namespace shown_text_test
}  // namespace mocap::cli
