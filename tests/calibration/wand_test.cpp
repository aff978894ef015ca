#include "calibration/wand/wand.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap::calibration {
namespace {

const Wand kThree{{0.0, 0.16, 0.5}};
const Wand kTwo{{0.0, 0.5}};

std::vector<Eigen::Vector2d> laid_from(const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  return {from, from + 0.32 * (to - from), to};
}

TEST(FindWand, TellsItsFirstMarkerFromItsLast) {
  std::vector<Eigen::Vector2d> spots = laid_from({300, 200}, {100, 150});
  std::swap(spots[0], spots[1]);

  const WandLook look = find_wand(spots, kThree, {});

  ASSERT_TRUE(look.seen);
  EXPECT_EQ(look.spots, (WandSpots{1, 0, 2}));
  EXPECT_FALSE(look.twice);
}

TEST(FindWand, FindsItAmongClutter) {
  std::vector<Eigen::Vector2d> spots{{20, 900}, {700, 30}, {333, 444}, {640, 512}};
  for (const Eigen::Vector2d& spot : laid_from({400, 300}, {480, 420})) spots.push_back(spot);

  const WandLook look = find_wand(spots, kThree, {});

  ASSERT_TRUE(look.seen);
  EXPECT_EQ(look.spots, (WandSpots{4, 5, 6}));
}

TEST(FindWand, SeesNoneInABentLine) {
  std::vector<Eigen::Vector2d> spots = laid_from({300, 200}, {100, 200});
  spots[1].y() += 10.0;

  EXPECT_FALSE(find_wand(spots, kThree, {}).seen);
}

TEST(FindWand, SeesNoneThatIsDividedElsewhere) {
  const std::vector<Eigen::Vector2d> spots{{300, 200}, {208, 200}, {100, 200}};

  EXPECT_FALSE(find_wand(spots, kThree, {}).seen);
}

TEST(FindWand, TellsThatThereAreTwo) {
  std::vector<Eigen::Vector2d> spots = laid_from({300, 200}, {100, 150});
  for (const Eigen::Vector2d& spot : laid_from({500, 800}, {700, 700})) spots.push_back(spot);

  EXPECT_TRUE(find_wand(spots, kThree, {}).twice);
}

TEST(FindWand, LeavesAFourthMarkerOnTheLineUndecided) {
  // Two spots side by side where the middle one should be: either may be it.
  std::vector<Eigen::Vector2d> spots = laid_from({300, 200}, {100, 200});
  spots.emplace_back(spots[1].x() - 1.5, 200);

  EXPECT_FALSE(find_wand(spots, kThree, {}).seen);
}

TEST(FindWand, TakesTwoMarkersOnlyWhereTheyAreAlone) {
  std::vector<Eigen::Vector2d> spots{{100, 100}, {200, 150}};
  EXPECT_TRUE(find_wand(spots, kTwo, {}).seen);

  spots.emplace_back(500, 500);
  EXPECT_FALSE(find_wand(spots, kTwo, {}).seen);
}

}  // namespace
}  // namespace mocap::calibration
