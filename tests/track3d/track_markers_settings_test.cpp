#include "track3d/track_markers_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::track3d {
namespace {

TEST(TrackMarkersSettings, HaveDefaultsWithinTheirRanges) {
  const TrackMarkersSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace
}  // namespace mocap::track3d
