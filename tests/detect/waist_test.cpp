#include "detect/centroid/waist.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace mocap::detect {
namespace waist_test {

using Eigen::Vector2d;

constexpr int kSize_px = 48;
constexpr std::uint32_t kThreshold = 40;

// A box with discs of light, 200 grey levels over a dark background. The rims are smooth over about one pixel.
struct Picture {
  void add_disc(const Vector2d& centre_px, double radius_px) {
    for (int y = 0; y < kSize_px; ++y) {
      for (int x = 0; x < kSize_px; ++x) {
        const double inside = radius_px + 0.5 - (Vector2d(x, y) - centre_px).norm();
        const auto grey = static_cast<std::uint16_t>(200.0 * std::clamp(inside, 0.0, 1.0));
        std::uint16_t& pixel = pixels[static_cast<std::size_t>(y * kSize_px + x)];
        pixel = std::max(pixel, grey);
      }
    }
  }
  // Light of a disc that moves from one point to another during the exposure.
  void add_streak(const Vector2d& from_px, const Vector2d& to_px, double radius_px) {
    for (double share = 0.0; share <= 1.0; share += 0.02) add_disc(from_px + share * (to_px - from_px), radius_px);
  }
  Box box() const { return {pixels.data(), kSize_px, kSize_px}; }

  std::vector<std::uint16_t> pixels = std::vector<std::uint16_t>(kSize_px * kSize_px);
};

const Vector2d kMiddle_px(23.0, 24.0);

Vector2d axis_at(double degrees) { return {std::cos(degrees * M_PI / 180.0), std::sin(degrees * M_PI / 180.0)}; }

TEST(Waist, LiesBetweenTwoDiscsThatTouch) {
  for (double degrees = 0.0; degrees < 180.0; degrees += 15.0) {
    const Vector2d axis = axis_at(degrees);
    Picture picture;
    picture.add_disc(kMiddle_px - 6.0 * axis, 6.0);
    picture.add_disc(kMiddle_px + 8.0 * axis, 8.0);

    const Waist waist = find_waist(picture.box(), kThreshold, kMiddle_px, axis);

    EXPECT_TRUE(waist.splits) << degrees;
    EXPECT_TRUE(waist.doubtful) << degrees;
    EXPECT_NEAR(waist.at_px, 0.0, 1.5) << degrees;  // px: the discs touch at 0, in bins of one pixel
  }
}

TEST(Waist, IsAbsentInOneDiscAndInAStreak) {
  for (double degrees = 0.0; degrees < 180.0; degrees += 15.0) {
    const Vector2d axis = axis_at(degrees);
    Picture disc, streak;
    disc.add_disc(kMiddle_px, 7.3);
    streak.add_streak(kMiddle_px - 6.0 * axis, kMiddle_px + 6.0 * axis, 5.0);

    EXPECT_FALSE(find_waist(disc.box(), kThreshold, kMiddle_px, axis).doubtful) << degrees;
    EXPECT_FALSE(find_waist(streak.box(), kThreshold, kMiddle_px, axis).doubtful) << degrees;
  }
}

TEST(Waist, IsAbsentInADarkBox) {
  const Picture dark;

  const Waist waist = find_waist(dark.box(), kThreshold, kMiddle_px, axis_at(0.0));

  EXPECT_FALSE(waist.splits);
  EXPECT_FALSE(waist.doubtful);
}

TEST(KeepSide, DividesThePixelsBetweenBothSides) {
  Picture picture;
  picture.add_disc(kMiddle_px, 10.0);
  const Vector2d axis = axis_at(30.0);
  std::vector<std::uint16_t> far = picture.pixels, near = picture.pixels;

  keep_side(far, picture.box(), kMiddle_px, axis, 2.5, true);
  keep_side(near, picture.box(), kMiddle_px, axis, 2.5, false);

  for (int y = 0; y < kSize_px; ++y) {
    for (int x = 0; x < kSize_px; ++x) {
      const auto i = static_cast<std::size_t>(y * kSize_px + x);
      const bool is_far = axis.dot(Vector2d(x, y) - kMiddle_px) >= 2.5;
      EXPECT_EQ(far[i], is_far ? picture.pixels[i] : 0);
      EXPECT_EQ(near[i], is_far ? 0 : picture.pixels[i]);
    }
  }
}

TEST(Moments, AreThoseOfAUniformRectangle) {
  Picture picture;
  for (int y = 10; y < 16; ++y) {
    for (int x = 20; x < 29; ++x) picture.pixels[static_cast<std::size_t>(y * kSize_px + x)] = 100;
  }

  const Eigen::Vector3d moments = moments_of(picture.box(), kThreshold);

  // px^2: the variance of a uniform distribution over 9 px and over 6 px.
  EXPECT_NEAR(moments[0], 9.0 * 9.0 / 12.0, 1e-9);
  EXPECT_NEAR(moments[1], 6.0 * 6.0 / 12.0, 1e-9);
  EXPECT_NEAR(moments[2], 0.0, 1e-9);
}

TEST(Moments, HaveTheAxisOfATiltedStreak) {
  Picture picture;
  const Vector2d axis = axis_at(35.0);
  picture.add_streak(kMiddle_px - 12.0 * axis, kMiddle_px + 12.0 * axis, 3.0);

  const Eigen::Vector3d moments = moments_of(picture.box(), kThreshold);

  EXPECT_NEAR(0.5 * std::atan2(2.0 * moments[2], moments[0] - moments[1]) * 180.0 / M_PI, 35.0, 1.0);
}

TEST(Moments, OfADarkBoxAreRoundAndPositive) {
  EXPECT_EQ(moments_of(Picture().box(), kThreshold), Eigen::Vector3d(1.0, 1.0, 0.0));
}

}  // namespace waist_test
}  // namespace mocap::detect
