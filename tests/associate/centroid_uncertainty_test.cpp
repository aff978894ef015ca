#include "associate/rays/centroid_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "detect/blob_detector.h"
#include "scene/render.h"

namespace mocap::associate {
namespace centroid_uncertainty_test {

constexpr int kSize_px = 64;

/// The detected blobs of rendered discs.
class DiscImages {
 public:
  Blobs see(std::span<const scene::Disc> discs) {
    renderer_.render(discs, number_++, pixels_);
    return detector_->detect(Image{pixels_, kSize_px, kSize_px, kSize_px, PixelFormat::Mono8}).blobs;
  }

 private:
  scene::Renderer renderer_{kSize_px, kSize_px, {}, 0};
  std::unique_ptr<Detector> detector_ =
      std::move(detect::make_blob_detector({}, PixelFormat::Mono8, kSize_px, kSize_px)).value();
  std::vector<std::byte> pixels_ = std::vector<std::byte>(kSize_px * kSize_px);
  std::uint64_t number_ = 0;
};

scene::Disc disc_at(const Eigen::Vector2d& middle_px, double radius_px) {
  return {middle_px, middle_px, radius_px, 1.0};
}

TEST(CentroidUncertainty, OfASingleDiscIsTheSigmaOfTheDetector) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> at(30.0, 34.0);
  std::uniform_real_distribution<double> size(1.5, 6.0);
  DiscImages images;
  int uncertain = 0;

  for (int k = 0; k < 1000; ++k) {
    const std::vector<scene::Disc> disc{disc_at({at(random), at(random)}, size(random))};
    const Blobs blobs = images.see(disc);
    ASSERT_EQ(blobs.size(), 1u);
    uncertain += centroid_sigma_px(blobs[0]) > 0.25 ? 1 : 0;
  }

  EXPECT_LE(uncertain, 10);  // 1 %: the pixel grid rarely makes a disc elongated
}

TEST(CentroidUncertainty, OfAMergedBlobGivesTheDistanceAndDirectionOfItsHalves) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> at(30.0, 34.0);
  std::uniform_real_distribution<double> direction(0.0, std::numbers::pi);
  DiscImages images;

  for (double half_px = 1.3; half_px <= 2.0; half_px += 0.1) {
    for (int k = 0; k < 20; ++k) {
      const double angle = direction(random);
      const Eigen::Vector2d middle(at(random), at(random));
      const Eigen::Vector2d off = half_px * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      const std::vector<scene::Disc> pair{disc_at(middle + off, 1.6), disc_at(middle - off, 1.6)};
      const Blobs blobs = images.see(pair);
      if (blobs.size() != 1) continue;  // the discs are separate blobs

      // One pixel more or less at an end changes the second moment as much as half a pixel of distance.
      EXPECT_NEAR(spread_px(blobs[0]), half_px, 0.5) << half_px << " " << angle;
      EXPECT_GT(std::abs(std::cos(blobs[0].axis_rad - angle)), std::cos(0.3)) << half_px << " " << angle;
      EXPECT_GT(centroid_sigma_px(blobs[0]), 0.5 * half_px);
    }
  }
}

TEST(CentroidUncertainty, GrowsForABlobMuchLargerThanTypical) {
  Blob triple;
  triple.area_px2 = 46.0;
  triple.roundness = 0.97;

  EXPECT_GT(crowd_offset_px(triple, 15.0), 1.5);
  EXPECT_EQ(crowd_offset_px(triple, 30.0), 0.0);  // not large enough: a single marker near the camera
}

}  // namespace centroid_uncertainty_test
}  // namespace mocap::associate
