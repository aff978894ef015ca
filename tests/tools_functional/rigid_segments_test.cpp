#include "lib/functional/rigid_segments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "test_motion.h"

namespace mocap::functional {
namespace rigid_segments_test {

using testing::ElementsAre;

// Two boxes of four markers, of which the second turns about a point beside it.
Eigen::Vector3d box_corner(std::size_t frame, std::size_t marker) {
  const auto corner = marker % 4;
  const Eigen::Vector3d place(0.1 * (corner == 1), 0.1 * (corner == 2), 0.1 * (corner == 3));
  if (marker < 4) return place;
  const double rad = 0.02 * static_cast<double>(frame);
  return Eigen::Vector3d(0.0, 0.3, 0.0) +
         kinematics::from_rotation_vector({0.8 * std::sin(rad), 0.0, 0.8 * std::cos(rad)}) *
             (place + Eigen::Vector3d(0.05, 0.1, 0.05));
}

TEST(RigidSegments, AreMarkersThatKeepTheirDistances) {
  const auto take = test_motion::take_of(400, 8, 0.003, box_corner);

  EXPECT_THAT(find_rigid_segments(take, {}), ElementsAre(ElementsAre(0, 1, 2, 3), ElementsAre(4, 5, 6, 7)));
}

TEST(RigidSegments, StandExchangedLabelsInAHundredthOfTheFrames) {
  auto take = test_motion::take_of(400, 8, 0.001, box_corner);
  for (const std::size_t frame : {50u, 51u, 200u}) std::swap(take.places_m[8 * frame], take.places_m[8 * frame + 5]);

  EXPECT_THAT(find_rigid_segments(take, {}), ElementsAre(ElementsAre(0, 1, 2, 3), ElementsAre(4, 5, 6, 7)));
}

TEST(RigidSegments, DoNotJoinAMarkerThatIsSeldomSeen) {
  auto take = test_motion::take_of(400, 8, 0.001, box_corner);
  for (std::size_t frame = 20; frame < 400; ++frame)
    take.places_m[8 * frame + 3].setConstant(std::numeric_limits<double>::quiet_NaN());

  EXPECT_THAT(find_rigid_segments(take, {}),
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(3), ElementsAre(4, 5, 6, 7)));
}

TEST(RigidSegments, OfAnEmptyTakeAreNone) { EXPECT_TRUE(find_rigid_segments({}, {}).empty()); }

}  // namespace rigid_segments_test
}  // namespace mocap::functional
