#include "track2d/track_blobs_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::track2d {
namespace {

TEST(TrackBlobsSettings, HaveDefaultsWithinTheirRanges) {
  const TrackBlobsSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

}  // namespace
}  // namespace mocap::track2d
