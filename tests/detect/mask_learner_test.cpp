#include "detect/mask_learner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "detect/blob_detector.h"

namespace mocap::detect {
namespace mask_learner_test {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr double kThreshold = 60.0;

/// An image with background noise, in which a test draws lights.
class Canvas {
 public:
  explicit Canvas(std::uint32_t seed) : random_(seed) {}

  void dark() {
    std::normal_distribution<double> noise(12.0, 2.0);
    for (std::byte& pixel : pixels_) pixel = static_cast<std::byte>(std::clamp(noise(random_), 0.0, 255.0));
  }
  void disc(double x, double y, double radius_px) {
    for_each([&](int px, int py) { return std::hypot(px - x, py - y) <= radius_px; });
  }
  void box(int x, int y, int width, int height) {
    for_each([&](int px, int py) { return px >= x && px < x + width && py >= y && py < y + height; });
  }
  Image image() const { return {pixels_, kWidth, kWidth, kHeight, PixelFormat::Mono8}; }

 private:
  template <class Inside>
  void for_each(Inside inside) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if (inside(x, y)) pixels_[static_cast<std::size_t>(y * kWidth + x)] = std::byte{200};
      }
    }
  }

  std::mt19937 random_;
  std::vector<std::byte> pixels_ = std::vector<std::byte>(kWidth * kHeight);
};

/// The mask that is learned from 100 images, each drawn by `draw`.
template <class Draw>
LearntMask learn(Draw draw, std::span<const MaskPolygon> masked = {}) {
  MaskLearner learner(kWidth, kHeight, masked);
  Canvas canvas(7);
  for (int i = 0; i < 100; ++i) {
    canvas.dark();
    draw(canvas, i);
    EXPECT_TRUE(learner.add(canvas.image(), kThreshold));
  }
  return learner.learn({});
}

bool masks(const LearntMask& learnt, int x, int y) { return RowMask(learnt.polygons, kWidth, kHeight).masks(x, y); }

TEST(MaskLearner, MasksALampWithItsMarginOnly) {
  const LearntMask learnt = learn([](Canvas& canvas, int) { canvas.disc(50, 40, 6); });

  EXPECT_EQ(learnt.lights, 1U);
  EXPECT_EQ(learnt.moved, 0U);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double distance_px = std::hypot(x - 50, y - 40);
      const bool within = distance_px <= 6.0 + 4.0;
      // The square shape of pixels, the octagon around a corner and rounding to 0.1 px add less than 1.5 px.
      const bool without = distance_px > 6.0 + 4.0 + 1.5;
      EXPECT_TRUE(!within || masks(learnt, x, y)) << x << " " << y;
      EXPECT_TRUE(!without || !masks(learnt, x, y)) << x << " " << y;
    }
  }
  const double area_px2 = M_PI * 10.0 * 10.0;
  EXPECT_NEAR(learnt.covered_share * kWidth * kHeight, area_px2, 0.25 * area_px2);
}

TEST(MaskLearner, MasksALampThatFlickers) {
  const LearntMask learnt = learn([](Canvas& canvas, int i) {
    if (i % 3 == 0) canvas.disc(50, 40, i % 2 == 0 ? 6.0 : 7.0);
  });

  EXPECT_EQ(learnt.lights, 1U);
  EXPECT_TRUE(masks(learnt, 50, 40));
}

TEST(MaskLearner, DoesNotMaskAMovingMarkerAndReportsIt) {
  const LearntMask learnt = learn([](Canvas& canvas, int i) {
    canvas.disc(20, 20, 5);
    canvas.disc(30 + i, 80, 4);
  });

  EXPECT_EQ(learnt.lights, 1U);
  EXPECT_EQ(learnt.moved, 1U);
  EXPECT_TRUE(masks(learnt, 20, 20));
  for (int x = 30; x < 130; ++x) EXPECT_FALSE(masks(learnt, x, 80)) << x;
}

TEST(MaskLearner, DoesNotMaskAMarkerOnAPersonWhoSways) {
  const LearntMask learnt = learn([](Canvas& canvas, int i) { canvas.disc(60 + 4.0 * std::sin(0.1 * i), 60, 4); });

  EXPECT_EQ(learnt.lights, 0U);
  EXPECT_EQ(learnt.moved, 1U);
  EXPECT_TRUE(learnt.polygons.empty());
}

TEST(MaskLearner, DoesNotMaskALampThatAMarkerPasses) {
  const LearntMask learnt = learn([](Canvas& canvas, int i) {
    canvas.disc(80, 60, 6);
    canvas.disc(30 + i, 60, 4);
  });

  EXPECT_EQ(learnt.lights, 0U);
  EXPECT_EQ(learnt.moved, 1U);
}

TEST(MaskLearner, DoesNotCountNoiseAsAMarker) {
  const LearntMask learnt = learn([](Canvas& canvas, int i) {
    if (i == 50) canvas.box(10, 10, 2, 1);
  });

  EXPECT_EQ(learnt.moved, 0U);
  EXPECT_TRUE(learnt.polygons.empty());
  EXPECT_EQ(learnt.covered_share, 0.0);
}

TEST(MaskLearner, DoesNotMaskTheInsideOfAWindowFrame) {
  const LearntMask learnt = learn([](Canvas& canvas, int) {
    canvas.box(20, 20, 100, 3);
    canvas.box(20, 90, 100, 3);
    canvas.box(20, 20, 3, 73);
    canvas.box(117, 20, 3, 73);
  });

  EXPECT_EQ(learnt.lights, 1U);
  EXPECT_GT(learnt.polygons.size(), 3U);
  EXPECT_TRUE(masks(learnt, 70, 21));
  EXPECT_TRUE(masks(learnt, 21, 50));
  EXPECT_FALSE(masks(learnt, 70, 55));
}

TEST(MaskLearner, LearnsUnmaskedLightsAndCountsTheAreaOfAllMasks) {
  const std::vector<MaskPolygon> drawn{{{{40.0, 30.0}}, {{60.0, 30.0}}, {{60.0, 50.0}}, {{40.0, 50.0}}}};
  const LearntMask learnt = learn(
      [](Canvas& canvas, int) {
        canvas.disc(50, 40, 6);
        canvas.disc(120, 90, 3);
      },
      drawn);

  EXPECT_EQ(learnt.lights, 1U);
  EXPECT_FALSE(masks(learnt, 50, 40));
  EXPECT_TRUE(masks(learnt, 120, 90));
  EXPECT_GT(learnt.covered_share * kWidth * kHeight, 400.0);
}

TEST(MaskLearner, RefusesAnImageOfAnotherSize) {
  MaskLearner learner(kWidth, kHeight);
  const std::vector<std::byte> pixels(100);

  EXPECT_FALSE(learner.add({pixels, 10, 10, 10, PixelFormat::Mono8}, kThreshold));
  EXPECT_FALSE(learner.add({pixels, kWidth, kWidth, kHeight, PixelFormat::Mono8}, kThreshold)) << "bytes are missing";
  EXPECT_EQ(learner.images(), 0U);
  EXPECT_TRUE(learner.learn({}).polygons.empty());
}

TEST(MaskLearner, GivesTheDetectorAMaskThatHidesTheLampAndNotTheMarker) {
  const LearntMask learnt = learn([](Canvas& canvas, int) { canvas.disc(50, 40, 6); });
  auto detector = make_blob_detector({}, PixelFormat::Mono8, kWidth, kHeight, learnt.polygons);
  ASSERT_TRUE(detector);
  Canvas canvas(8);
  canvas.dark();
  canvas.disc(50, 40, 6);
  canvas.disc(70, 40, 4);

  const Detection seen = (*detector)->detect(canvas.image());

  ASSERT_EQ(seen.blobs.size(), 1U);
  EXPECT_NEAR(seen.blobs[0].centroid.v.x(), 70.0, 0.1);  // px; a disc of 49 pixels
  EXPECT_FALSE(seen.blobs[0].touches_border);
}

}  // namespace mask_learner_test
}  // namespace mocap::detect
