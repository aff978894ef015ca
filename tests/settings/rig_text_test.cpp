#include "settings/rig/rig_text.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

namespace mocap::settings {
namespace rig_text_test {

TEST(NumberText, ReadsBackAsTheSameBits) {
  for (const double value : {0.1, -1.0 / 3.0, 1e-300, 1e300, 123456789.0, std::numeric_limits<double>::denorm_min()}) {
    EXPECT_EQ(std::strtod(number_text(value).c_str(), nullptr), value) << number_text(value);
  }
}

TEST(NumberText, IsAlwaysAFloat) {
  EXPECT_EQ(number_text(1.0), "1.0");
  EXPECT_EQ(number_text(-20.0), "-20.0");
  EXPECT_EQ(number_text(0.5), "0.5");
}

TEST(QuotedText, EscapesWhatTomlDoesNotTakeAsItIs) {
  EXPECT_EQ(quoted_text("north east"), "\"north east\"");
  EXPECT_EQ(quoted_text("a\"b\\c"), "\"a\\\"b\\\\c\"");
  EXPECT_EQ(quoted_text("a\nb"), "\"a\\u000ab\"");
}

TEST(ListText, HasOneFloatAfterTheOther) { EXPECT_EQ(list_text({1.0, 2.5}), "[1.0, 2.5]"); }

TEST(MaskText, HasOnePolygonPerLine) {
  const std::vector<MaskPolygon> masks{{PixelPoint{{0.0, 0.0}}, PixelPoint{{1.0, 0.0}}, PixelPoint{{0.0, 1.0}}}};

  EXPECT_EQ(mask_text({}), "[]");
  EXPECT_EQ(mask_text(masks), "[\n  [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],\n]");
}

}  // namespace rig_text_test
}  // namespace mocap::settings
