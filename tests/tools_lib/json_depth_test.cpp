#include "lib/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace mocap {
namespace json_depth_test {

std::string nested(int depth) { return std::string(static_cast<std::size_t>(depth), '['); }

TEST(IsDeep, CountsTheBracketsThatAreOpen) {
  EXPECT_FALSE(is_deep(nested(kMaxJsonDepth)));
  EXPECT_TRUE(is_deep(nested(kMaxJsonDepth + 1)));
  EXPECT_FALSE(
      is_deep(R"([{"a":[]},{"a":[]},{"a":[]},{"a":[]},{"a":[]},{"a":[]},{"a":[]},{"a":[]},{"a":[]},{"a":[]},{}])"));
}

TEST(IsDeep, LeavesOutBracketsWithinStrings) {
  const std::string closing = R"("\"]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]",)";

  EXPECT_FALSE(is_deep(R"({"notes":")" + nested(100) + R"("})"));
  EXPECT_TRUE(is_deep(nested(20) + closing + nested(20)));
  EXPECT_FALSE(is_deep(nested(20) + closing + "]"));
}

}  // namespace json_depth_test
}  // namespace mocap
