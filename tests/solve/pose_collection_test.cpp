#include "solve/pose_collection.h"

#include <gtest/gtest.h>

#include "support/test_body.h"

namespace mocap::solve {
namespace pose_collection_test {

using bodyfit::BodyInstant;

class PoseCollectionTest : public testing::Test {
 protected:
  BodyInstant bent(double angle_rad) const {
    BodyInstant instant = bodyfit::empty_instant(set_);
    instant.locals[1].rotation = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX());
    return instant;
  }

  MarkerSet set_ = test::person("openmocap18");
  PoseCollection poses_{set_, 3};
};

TEST_F(PoseCollectionTest, IsFilledWithTheFirstPoses) {
  for (const double angle_rad : {0.0, 0.1, 0.2}) EXPECT_TRUE(poses_.add_if_different(bent(angle_rad)));

  EXPECT_EQ(poses_.size(), 3U);
}

TEST_F(PoseCollectionTest, ReplacesTheLaterOfTheTwoMostSimilarPoses) {
  for (const double angle_rad : {0.0, 1.0, 1.1}) EXPECT_TRUE(poses_.add_if_different(bent(angle_rad)));

  EXPECT_TRUE(poses_.add_if_different(bent(2.0)));

  EXPECT_EQ(poses_.size(), 3U);
  EXPECT_NEAR(poses_.nearest(bent(2.0)), 0.0, 1e-12);
  EXPECT_GT(poses_.nearest(bent(1.1)), 1e-3) << "it was the later one of 1.0 and 1.1";
}

TEST_F(PoseCollectionTest, RefusesAPoseThatIsMoreAlikeThanThoseItHas) {
  for (const double angle_rad : {0.0, 1.0, 2.0}) EXPECT_TRUE(poses_.add_if_different(bent(angle_rad)));

  EXPECT_FALSE(poses_.add_if_different(bent(0.05)));
}

}  // namespace pose_collection_test
}  // namespace mocap::solve
