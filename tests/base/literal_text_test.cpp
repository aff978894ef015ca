#include "base/literal_text.h"

#include <gtest/gtest.h>

#include <cstdlib>

namespace mocap {
namespace literal_text_test {

TEST(LiteralText, NumbersAreReadBackBitIdenticalAndHaveADecimalPoint) {
  for (const double value : {0.1, 1.0 / 3.0, -2.5e-300, 1e22, 123456789.0}) {
    const std::string text = number_text(value);
    EXPECT_EQ(std::strtod(text.c_str(), nullptr), value) << text;
    EXPECT_NE(text.find_first_of(".e"), std::string::npos) << text;
  }
  EXPECT_EQ(number_text(2.0), "2.0");
}

TEST(LiteralText, QuotesAreEscaped) { EXPECT_EQ(quoted_text("a\"b\\c\n"), R"("a\"b\\c\u000a")"); }

TEST(LiteralText, ListsAreInBrackets) {
  EXPECT_EQ(list_text({1.0, 2.5}), "[1.0, 2.5]");
  EXPECT_EQ(list_text({}), "[]");
}

}  // namespace literal_text_test
}  // namespace mocap
