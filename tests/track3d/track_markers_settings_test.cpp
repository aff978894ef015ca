#include "track3d/track_markers_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::track3d {
namespace track_markers_settings_test {

TEST(TrackMarkersSettings, HaveDefaultsWithinTheirRanges) {
  const TrackMarkersSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace track_markers_settings_test
}  // namespace mocap::track3d
