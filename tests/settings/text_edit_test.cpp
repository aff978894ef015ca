#include "settings/toml/text_edit.h"

#include <gtest/gtest.h>

namespace mocap::settings {
namespace text_edit_test {

TEST(LineIndex, FindsTheOffsetOfALineAndColumn) {
  const std::string text = "one\ntwo\n\nfour";
  const LineIndex lines(text);

  EXPECT_EQ(lines.offset_of(1, 1), 0U);
  EXPECT_EQ(lines.offset_of(2, 3), 6U);
  EXPECT_EQ(lines.offset_of(4, 1), 9U);
  EXPECT_EQ(lines.offset_of(4, 99), text.size());
}

TEST(LineIndex, FindsTheOffsetsOfATextThatBeginsWithAnEmptyLine) {
  const std::string text = "\n\ntwo";
  const LineIndex lines(text);

  EXPECT_EQ(lines.offset_of(1, 1), 0U);
  EXPECT_EQ(lines.offset_of(2, 1), 1U);
  EXPECT_EQ(lines.offset_of(3, 2), 3U);
}

TEST(LineIndex, FindsTheNextLine) {
  const std::string text = "one\ntwo";
  const LineIndex lines(text);

  EXPECT_EQ(lines.next_line(1), 4U);
  EXPECT_EQ(lines.next_line(3), 4U);
  EXPECT_EQ(lines.next_line(5), text.size());
}

TEST(Edited, AppliesAllEditsToTheirOffsetsInTheOldText) {
  const std::string text = "a = 1\nb = 2\n";

  EXPECT_EQ(edited(text, {{4, 5, "100"}, {10, 11, "3"}, {12, 12, "c = 4\n"}}), "a = 100\nb = 3\nc = 4\n");
  EXPECT_EQ(edited(text, {{10, 11, "3"}, {4, 5, "100"}}), "a = 100\nb = 3\n") << "in any order";
  EXPECT_EQ(edited(text, {}), text);
}

}  // namespace text_edit_test
}  // namespace mocap::settings
