#include "timecode/timecode_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::timecode {
namespace timecode_settings_test {

TEST(TimecodeSettings, HaveDefaultsWithinTheirRanges) {
  TimecodeSettings settings;
  KeyCheck check;
  declare_keys(check, settings);

  EXPECT_TRUE(check.faults().empty());
  EXPECT_EQ(settings.source, TimecodeSourceKind::None);
}

TEST(TimecodeSettings, NameEveryRate) {
  const auto name = [](std::uint32_t frames_per_second, bool drop_frame, bool fractional) {
    Timecode format;
    format.frames_per_second = frames_per_second;
    format.drop_frame = drop_frame;
    format.fractional = fractional;
    return rate_name(format);
  };
  EXPECT_EQ(name(24, false, true), "23.976");
  EXPECT_EQ(name(24, false, false), "24");
  EXPECT_EQ(name(25, false, false), "25");
  EXPECT_EQ(name(30, false, true), "29.97");
  EXPECT_EQ(name(30, true, true), "29.97drop");
  EXPECT_EQ(name(30, false, false), "30");
}

}  // namespace timecode_settings_test
}  // namespace mocap::timecode
