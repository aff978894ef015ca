#include "associate/match_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::associate {
namespace match_settings_test {

TEST(MatchSettings, HaveDefaultsWithinTheirRanges) {
  const MatchSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

TEST(MatchSettings, RefuseAVolumeWithoutExtentOnAnAxis) {
  MatchSettings match;
  EXPECT_TRUE(faults_of(match).empty());

  match.volume_max_m.z() = match.volume_min_m.z();

  ASSERT_EQ(faults_of(match).size(), 1U);
  EXPECT_EQ(faults_of(match)[0].key, "volume_min_m");
}

TEST(MatchSettings, IncludeTheFacesOfTheVolume) {
  const MatchSettings match;

  EXPECT_TRUE(match.in_volume(match.volume_min_m));
  EXPECT_TRUE(match.in_volume(match.volume_max_m));
  EXPECT_FALSE(match.in_volume(match.volume_max_m + Eigen::Vector3d(0.0, 0.0, 1e-6)));
}

}  // namespace match_settings_test
}  // namespace mocap::associate
