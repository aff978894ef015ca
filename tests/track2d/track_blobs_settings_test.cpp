#include "track2d/track_blobs_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::track2d {
namespace track_blobs_settings_test {

TEST(TrackBlobsSettings, HaveDefaultsWithinTheirRanges) {
  const TrackBlobsSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace track_blobs_settings_test
}  // namespace mocap::track2d
