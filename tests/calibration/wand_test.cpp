#include "calibration/wand/wand.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap::calibration {
namespace wand_test {

const Wand kThree{{0.0, 0.16, 0.5}};
const Wand kTwo{{0.0, 0.5}};

std::vector<Eigen::Vector2d> wand_blobs(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return {from, from + 0.32 * (to - from), to};
}

TEST(DetectWand, OrdersTheMarkersByTheDivisionRatio) {
  std::vector<Eigen::Vector2d> blobs = wand_blobs({300, 200}, {100, 150});
  std::swap(blobs[0], blobs[1]);

  const WandDetection detection = detect_wand(blobs, kThree, {});

  ASSERT_TRUE(detection.found);
  EXPECT_EQ(detection.blobs, (WandBlobs{1, 0, 2}));
  EXPECT_FALSE(detection.two_wands);
}

TEST(DetectWand, FindsTheWandAmongClutter) {
  std::vector<Eigen::Vector2d> blobs{{20, 900}, {700, 30}, {333, 444}, {640, 512}};
  for (const Eigen::Vector2d& blob : wand_blobs({400, 300}, {480, 420})) blobs.push_back(blob);

  const WandDetection detection = detect_wand(blobs, kThree, {});

  ASSERT_TRUE(detection.found);
  EXPECT_EQ(detection.blobs, (WandBlobs{4, 5, 6}));
}

TEST(DetectWand, RejectsMarkersThatAreNotCollinear) {
  std::vector<Eigen::Vector2d> blobs = wand_blobs({300, 200}, {100, 200});
  blobs[1].y() += 10.0;

  EXPECT_FALSE(detect_wand(blobs, kThree, {}).found);
}

TEST(DetectWand, RejectsAnotherDivisionRatio) {
  const std::vector<Eigen::Vector2d> blobs{{300, 200}, {208, 200}, {100, 200}};

  EXPECT_FALSE(detect_wand(blobs, kThree, {}).found);
}

TEST(DetectWand, ReportsTwoWands) {
  std::vector<Eigen::Vector2d> blobs = wand_blobs({300, 200}, {100, 150});
  for (const Eigen::Vector2d& blob : wand_blobs({500, 800}, {700, 700})) blobs.push_back(blob);

  EXPECT_TRUE(detect_wand(blobs, kThree, {}).two_wands);
}

TEST(DetectWand, IsAmbiguousWithTwoMiddleMarkers) {
  // Two blobs side by side at the position of the middle marker.
  std::vector<Eigen::Vector2d> blobs = wand_blobs({300, 200}, {100, 200});
  blobs.emplace_back(blobs[1].x() - 1.5, 200);

  EXPECT_FALSE(detect_wand(blobs, kThree, {}).found);
}

TEST(DetectWand, FindsTwoMarkersOnlyWithoutOtherBlobs) {
  std::vector<Eigen::Vector2d> blobs{{100, 100}, {200, 150}};
  EXPECT_TRUE(detect_wand(blobs, kTwo, {}).found);

  blobs.emplace_back(500, 500);
  EXPECT_FALSE(detect_wand(blobs, kTwo, {}).found);
}

}  // namespace wand_test
}  // namespace mocap::calibration
