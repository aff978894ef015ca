#include "model/blob_use.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap {
namespace blob_use_test {

TEST(BlobUse, HasNoShareWithoutBlobs) {
  EXPECT_EQ(BlobUse{}.share(), std::nullopt);
  EXPECT_EQ((BlobUse{200, 50}).share(), 0.25);
  EXPECT_EQ((BlobUse{300, 150}).since({100, 100}).share(), 0.25);
}

TEST(WhyNoMarkers, NamesACameraWhoseBlobsAreInNoMarkers) {
  const std::vector<BlobUse> cameras{{1000, 900}, {1000, 30}, {1000, 840}};

  EXPECT_EQ(why_no_markers(cameras, 0), "");
  EXPECT_EQ(why_no_markers(cameras, 1), "3 % of its blobs are in 3D markers, 87 % of those of the other cameras");
}

TEST(WhyNoMarkers, IsSilentWithoutEvidence) {
  const std::vector<BlobUse> few{{40, 0}, {1000, 900}, {1000, 900}};
  const std::vector<BlobUse> all_wrong{{1000, 20}, {1000, 30}, {1000, 40}};

  EXPECT_EQ(why_no_markers(few, 0), "");
  EXPECT_EQ(why_no_markers(all_wrong, 0), "") << "no other camera agrees either: the camera is not to blame";
}

TEST(WhyNoMarkers, NamesACameraWhoseRaysIntersectByChanceOnly) {
  const std::vector<BlobUse> cameras{{800, 504}, {800, 120}, {800, 504}};

  EXPECT_NE(why_no_markers(cameras, 1), "") << "15 %, the most that a camera of a wrong rig had in one second";
  EXPECT_EQ(why_no_markers(cameras, 0), "");
}

TEST(WhyNoMarkers, DoesNotJudgeTwoCameras) {
  const std::vector<BlobUse> one_with_reflections{{1000, 950}, {19000, 950}};

  EXPECT_EQ(why_no_markers(one_with_reflections, 1), "");
}

}  // namespace blob_use_test
}  // namespace mocap
