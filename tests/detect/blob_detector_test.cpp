#include "detect/blob_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {
namespace blob_detector_test {

/// An image of one byte a pixel with its own pixels.
struct Picture {
  int width_px, height_px;
  std::size_t stride_bytes;
  std::vector<std::uint8_t> pixels;

  Picture(int width, int height, int padding = 0, std::uint8_t grey = 0)
      : width_px(width),
        height_px(height),
        stride_bytes(static_cast<std::size_t>(width + padding)),
        // The last row has no padding, so that a read past the last pixel is out of bounds.
        pixels(stride_bytes * static_cast<std::size_t>(height - 1) + static_cast<std::size_t>(width), grey) {}

  std::uint8_t& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * stride_bytes + static_cast<std::size_t>(x)];
  }
  Image image() const {
    return {std::as_bytes(std::span(pixels)), stride_bytes, width_px, height_px, PixelFormat::Mono8};
  }
};

std::unique_ptr<Detector> detector_for(const Picture& picture, const DetectSettings& settings = {}) {
  return std::move(make_blob_detector(settings, PixelFormat::Mono8, picture.width_px, picture.height_px)).value();
}

struct Disc {
  double x, y, radius_px;
};

/// Renders discs on a background with 16 x 16 samples for each pixel and normal noise, rounded to bytes.
Picture render(int width, int height, const std::vector<Disc>& discs, double noise_grey, std::mt19937& random) {
  constexpr double kBackground = 16.0;
  constexpr double kBright = 190.0;
  Picture picture(width, height);
  std::normal_distribution<double> noise(0.0, noise_grey);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double covered = 0.0;
      for (const Disc& disc : discs) {
        const double far = std::hypot(x - disc.x, y - disc.y);
        if (far < disc.radius_px - 1.0) covered += 256.0;
        if (far < disc.radius_px - 1.0 || far > disc.radius_px + 1.0) continue;
        for (int i = 0; i < 256; ++i) {
          const double sx = x - 0.5 + (i % 16 + 0.5) / 16.0;
          const double sy = y - 0.5 + (i / 16 + 0.5) / 16.0;
          covered += std::hypot(sx - disc.x, sy - disc.y) < disc.radius_px ? 1.0 : 0.0;
        }
      }
      const double grey =
          kBackground + kBright * std::min(1.0, covered / 256.0) + (noise_grey > 0.0 ? noise(random) : 0.0);
      picture.at(x, y) = static_cast<std::uint8_t>(std::clamp(std::round(grey), 0.0, 255.0));
    }
  }
  return picture;
}

/// Areas of the 8-connected components of pixels of at least `threshold`, by flood fill.
std::vector<double> flooded_areas(Picture picture, int threshold) {
  std::vector<double> areas;
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      if (picture.at(x, y) < threshold) continue;
      double area = 0.0;
      std::vector<std::pair<int, int>> open{{x, y}};
      picture.at(x, y) = 0;
      while (!open.empty()) {
        const auto [cx, cy] = open.back();
        open.pop_back();
        area += 1.0;
        for (int ny = std::max(0, cy - 1); ny <= std::min(picture.height_px - 1, cy + 1); ++ny) {
          for (int nx = std::max(0, cx - 1); nx <= std::min(picture.width_px - 1, cx + 1); ++nx) {
            if (picture.at(nx, ny) < threshold) continue;
            picture.at(nx, ny) = 0;
            open.emplace_back(nx, ny);
          }
        }
      }
      areas.push_back(area);
    }
  }
  std::sort(areas.begin(), areas.end());
  return areas;
}

TEST(DetectBlobs, FindsTheComponentsThatAFloodFillFindsOnRandomImages) {
  std::mt19937 random(3);
  const DetectSettings settings{
      .threshold = 128.0, .min_area_px2 = 1.0, .max_area_px2 = 1e6, .min_roundness = 0.0, .split_touching = false};
  for (int trial = 0; trial < 2000; ++trial) {
    const int width = trial % 7 == 0 ? 1 : static_cast<int>(random() % 70 + 1);
    const int height = trial % 11 == 0 ? 1 : static_cast<int>(random() % 24 + 1);
    Picture picture(width, height, static_cast<int>(random() % 5));
    const auto bright_of_8 = static_cast<unsigned>(trial % 9);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) picture.at(x, y) = random() % 8 < bright_of_8 ? 200 : 127;
    }

    const Detection found = detector_for(picture, settings)->detect(picture.image());

    std::vector<double> areas;
    for (const Blob& blob : found.blobs) areas.push_back(blob.area_px2);
    std::sort(areas.begin(), areas.end());
    ASSERT_EQ(areas, flooded_areas(picture, 128)) << "trial " << trial << " " << width << "x" << height;
  }
}

TEST(DetectBlobs, FindsCentroidsToAFiftiethOfAPixelWithACorrectSigma) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> shift(-0.5, 0.5);
  for (const double radius : {2.0, 3.0, 4.0, 6.0, 8.0}) {
    for (const double noise : {2.0, 3.0}) {
      double squares = 0.0;
      double normalised = 0.0;
      int n = 0;
      for (int image = 0; image < 4; ++image) {
        std::vector<Disc> discs;
        for (int i = 0; i < 60; ++i) {
          discs.push_back({24.0 + 32.0 * (i % 10) + shift(random), 24.0 + 32.0 * (i / 10) + shift(random), radius});
        }
        const Picture picture = render(336, 208, discs, noise, random);

        const Detection found = detector_for(picture)->detect(picture.image());

        ASSERT_EQ(found.blobs.size(), discs.size());
        for (const Blob& blob : found.blobs) {
          const auto nearest = std::min_element(discs.begin(), discs.end(), [&](const Disc& a, const Disc& b) {
            return std::hypot(a.x - blob.centroid.v.x(), a.y - blob.centroid.v.y()) <
                   std::hypot(b.x - blob.centroid.v.x(), b.y - blob.centroid.v.y());
          });
          const double error2 = (blob.centroid.v - Eigen::Vector2d(nearest->x, nearest->y)).squaredNorm() / 2.0;
          squares += error2;
          normalised += error2 / (blob.sigma_px * blob.sigma_px);
          ++n;
        }
      }
      const double rms_px = std::sqrt(squares / n);
      RecordProperty("rms_px_r" + std::to_string(radius) + "_noise" + std::to_string(noise), std::to_string(rms_px));
      EXPECT_LT(rms_px, 0.02) << "radius " << radius << " noise " << noise;
      // 240 blobs with two axes give the ratio to 3 %. The edges are sharper than those of any lens, and the model of
      // sigma is accurate to 30 % for such edges.
      EXPECT_NEAR(std::sqrt(normalised / n), 1.0, 0.3)
          << "radius " << radius << " noise " << noise << " rms " << rms_px;
    }
  }
}

TEST(DetectBlobs, ReadsTheSameBlobsFromEveryFormat) {
  std::mt19937 random(5);
  const Picture picture = render(75, 41, {{20.3, 18.2, 4.0}, {60.1, 20.7, 3.0}}, 2.0, random);
  const Detection reference = detector_for(picture)->detect(picture.image());
  ASSERT_EQ(reference.blobs.size(), 2U);
  struct Deep {
    PixelFormat format;
    int shift;  // left shift of the grey level; -1: the grey level is followed by an unrelated byte
  };
  for (const Deep& deep : {Deep{PixelFormat::Mono10, 2}, Deep{PixelFormat::Mono12, 4}, Deep{PixelFormat::Yuyv, -1}}) {
    std::vector<std::uint8_t> bytes;
    for (const std::uint8_t grey : picture.pixels) {
      const int word = deep.shift < 0 ? grey : grey << deep.shift;
      bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
      bytes.push_back(static_cast<std::uint8_t>(deep.shift < 0 ? random() % 256 : static_cast<unsigned>(word) >> 8U));
    }
    auto detector = std::move(make_blob_detector({}, deep.format, 75, 41)).value();

    const Detection found = detector->detect({std::as_bytes(std::span(bytes)), 150, 75, 41, deep.format});

    ASSERT_EQ(found.blobs.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      // The rounding of thresholds and weights does not scale with the levels: some thousandths of a pixel.
      EXPECT_LT((found.blobs[i].centroid.v - reference.blobs[i].centroid.v).norm(), 3e-3);
      EXPECT_NEAR(found.blobs[i].area_px2, reference.blobs[i].area_px2, 2.0);
    }
  }
}

TEST(DetectBlobs, FindsNothingInBlackWhiteAndNoise) {
  for (const int grey : {0, 100, 255}) {
    const Picture flat(200, 100, 3, static_cast<std::uint8_t>(grey));
    EXPECT_TRUE(detector_for(flat)->detect(flat.image()).blobs.empty()) << grey;
  }
  std::mt19937 random(1);
  const Picture noisy = render(640, 480, {}, 4.0, random);
  EXPECT_TRUE(detector_for(noisy)->detect(noisy.image()).blobs.empty());
}

TEST(DetectBlobs, MeasuresTheBrightestUnmaskedPixel) {
  Picture picture(64, 48, 3, 10);
  picture.at(20, 30) = 77;
  picture.at(50, 10) = 200;
  const std::vector<MaskPolygon> mask{{PixelPoint{{45.0, 5.0}}, {{55.0, 5.0}}, {{55.0, 15.0}}, {{45.0, 15.0}}}};
  const auto masked = std::move(make_blob_detector({}, PixelFormat::Mono8, 64, 48, mask)).value();

  EXPECT_EQ(detector_for(picture)->brightest_grey(picture.image()), 200.0);
  EXPECT_EQ(masked->brightest_grey(picture.image()), 77.0);
}

TEST(DetectBlobs, KeepsTheLargestBlobsAndCountsTheOthers) {
  Picture picture(200, 800);
  for (int i = 0; i < 40 * 40; ++i) {
    const int side = i % 3 == 0 ? 4 : 3;  // 534 of 16 px, the rest of 9 px
    for (int k = 0; k < side * side; ++k) picture.at(10 * (i % 20) + k % side, 10 * (i / 20) + k / side) = 250;
  }

  const Detection found = detector_for(picture)->detect(picture.image());

  EXPECT_EQ(found.blobs.size(), kMaxBlobs);
  EXPECT_EQ(found.dropped, 40U * 40U - kMaxBlobs);
  EXPECT_TRUE(
      std::all_of(found.blobs.begin(), found.blobs.end(), [](const Blob& blob) { return blob.area_px2 == 16.0; }));
}

TEST(DetectBlobs, DropsTheRowsBeyondTheRunBound) {
  // A row of 30 runs is not a noise row, but 1500 such rows exceed the bound of the image.
  Picture picture(1200, 1500);
  for (int y = 0; y < 1500; ++y) {
    for (int x = 5; x < 1200; x += 40) picture.at(x, y) = y % 4 < 3 ? 250 : 0;
  }

  const DetectSettings settings{.threshold = 100.0, .min_area_px2 = 1.0};
  std::vector<std::uint32_t> dropped_rows;
  for (const DetectKernels* kernels : all_kernels()) {
    const auto detector = std::move(make_blob_detector(settings, PixelFormat::Mono8, 1200, 1500, {}, kernels)).value();
    const Detection found = detector->detect(picture.image());

    dropped_rows.push_back(found.rows_given_up);
    EXPECT_GT(found.rows_given_up, 0U);
    // A blob is three rows high, or less at the boundary of a quarter of the image and of the dropped rows.
    const std::uint32_t rows = 1125U - found.rows_given_up;
    EXPECT_GE(found.blobs.size() + found.dropped + found.filtered, rows / 3 * 30);
    EXPECT_GT(rows * 30, 6144U);
  }
  EXPECT_EQ(std::ranges::count(dropped_rows, dropped_rows[0]), static_cast<std::ptrdiff_t>(dropped_rows.size()));
}

TEST(DetectBlobs, FiltersByAreaAndRoundness) {
  Picture picture(100, 60);
  picture.at(5, 5) = 250;                                                 // a hot pixel
  for (int x = 10; x < 50; ++x) picture.at(x, 20) = 250;                  // a line
  for (int i = 0; i < 25; ++i) picture.at(70 + i % 5, 40 + i / 5) = 250;  // a marker
  const DetectSettings settings{.threshold = 100.0};

  const Detection found = detector_for(picture, settings)->detect(picture.image());

  ASSERT_EQ(found.blobs.size(), 1U);
  EXPECT_EQ(found.filtered, 2U);
  EXPECT_NEAR(found.blobs[0].centroid.v.x(), 72.0, 1e-9);
  EXPECT_NEAR(found.blobs[0].centroid.v.y(), 42.0, 1e-9);
  EXPECT_NEAR(found.blobs[0].roundness, 1.0, 1e-9);
}

TEST(DetectBlobs, GivesABlobCutByTheBorderALargerSigma) {
  std::mt19937 random(2);
  const Picture picture = render(100, 60, {{1.0, 30.0, 5.0}, {60.0, 30.0, 5.0}}, 2.0, random);

  const Detection found = detector_for(picture)->detect(picture.image());

  ASSERT_EQ(found.blobs.size(), 2U);
  const bool first_is_cut = found.blobs[0].centroid.v.x() < 30.0;
  const Blob& cut = found.blobs[first_is_cut ? 0 : 1];
  const Blob& whole = found.blobs[first_is_cut ? 1 : 0];
  EXPECT_TRUE(cut.touches_border);
  EXPECT_FALSE(whole.touches_border);
  EXPECT_GT(cut.sigma_px, std::abs(cut.centroid.v.x() - 1.0) / 3.0);
  EXPECT_LT(whole.sigma_px, 0.02);
}

TEST(DetectBlobs, ExcludesTheLightOfANeighbourFromACentroid) {
  std::mt19937 random(2);
  const Picture picture = render(60, 40, {{20.0, 20.0, 4.0}, {31.0, 20.0, 5.0}}, 0.0, random);

  const Detection found = detector_for(picture)->detect(picture.image());

  ASSERT_EQ(found.blobs.size(), 2U);
  for (const Blob& blob : found.blobs) {
    // The discs are 2 px apart and their margins overlap: the faint light of a rim pixel may count for both.
    EXPECT_NEAR(blob.centroid.v.x(), blob.centroid.v.x() < 26.0 ? 20.0 : 31.0, 0.03);
    EXPECT_NEAR(blob.centroid.v.y(), 20.0, 0.03);
  }
}

TEST(DetectBlobs, GivesTheSameBlobsAfterAnyPreviousImages) {
  // The two discs are so near that the light of each is erased from the box of the other, at other positions in each
  // image.
  std::mt19937 random(23);
  std::uniform_real_distribution<double> place(20.0, 70.0), gap(1.5, 3.0);
  const auto used = detector_for(Picture(100, 100));

  for (int i = 0; i < 20; ++i) {
    const Disc first{place(random), place(random), 5.0};
    const Disc second{first.x + 9.0 + gap(random), first.y, 4.0};
    const Picture picture = render(100, 100, {first, second}, 2.0, random);
    const Detection again = used->detect(picture.image());
    const Detection fresh = detector_for(picture)->detect(picture.image());

    ASSERT_EQ(fresh.blobs.size(), 2U);
    ASSERT_EQ(again.blobs.size(), 2U);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(again.blobs[k].centroid.v, fresh.blobs[k].centroid.v);
      EXPECT_EQ(again.blobs[k].sigma_px, fresh.blobs[k].sigma_px);
    }
  }
}

TEST(DetectBlobs, ReportsTheShareOfSaturatedPixels) {
  Picture picture(64, 64, 0, 10);
  for (int y = 20; y < 30; ++y) {
    for (int x = 20; x < 30; ++x) picture.at(x, y) = y < 23 ? 255 : 254;
  }

  const Detection found = detector_for(picture)->detect(picture.image());

  ASSERT_EQ(found.blobs.size(), 1U);
  EXPECT_DOUBLE_EQ(found.blobs[0].saturated, 0.3);
  EXPECT_DOUBLE_EQ(found.blobs[0].peak, 1.0);
}

TEST(DetectBlobs, SeparatesTwoDiscsThatTouch) {
  std::mt19937 random(6);
  for (const double radius : {3.0, 5.0, 8.0}) {
    const Picture picture = render(80, 60, {{30.2, 30.1, radius}, {30.2 + 1.9 * radius, 33.4, radius}}, 2.0, random);

    const Detection found = detector_for(picture)->detect(picture.image());

    ASSERT_EQ(found.blobs.size(), 2U) << radius;
    const bool first_is_left = found.blobs[0].centroid.v.x() < found.blobs[1].centroid.v.x();
    const Blob& left = found.blobs[first_is_left ? 0 : 1];
    // Each disc is fitted to its own part of the rim. Tolerance: 6 standard deviations; the reported sigma must agree.
    EXPECT_NEAR(left.centroid.v.x(), 30.2, 0.08);
    EXPECT_NEAR(left.centroid.v.y(), 30.1, 0.08);
    EXPECT_LT(std::abs(left.centroid.v.x() - 30.2), 4.0 * left.sigma_px);
  }
}

TEST(DetectBlobs, GivesNoBlobsForAnImageWithMissingBytes) {
  Picture picture(64, 64, 0, 255);
  const auto detector = detector_for(picture, {.threshold = 10.0, .max_area_px2 = 1e6});
  Image image = picture.image();
  ASSERT_EQ(detector->detect(image).blobs.size(), 1U);

  image.bytes = image.bytes.first(image.bytes.size() - 1);
  EXPECT_TRUE(detector->detect(image).blobs.empty());
  image = picture.image();
  image.stride_bytes = 63;
  EXPECT_TRUE(detector->detect(image).blobs.empty());
  EXPECT_TRUE(detector->detect(Image{}).blobs.empty());
}

TEST(DetectBlobs, RefusesUnreadableFormatsAndSettingsOutsideTheirRanges) {
  EXPECT_EQ(make_blob_detector({}, PixelFormat::Mjpeg, 64, 64).error().code, ErrorCode::Unsupported);

  EXPECT_EQ(make_blob_detector({}, PixelFormat::Mono8, 0, 64).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(make_blob_detector({.threshold = 256.0}, PixelFormat::Mono8, 64, 64).error().code,
            ErrorCode::InvalidArgument);
  EXPECT_EQ(make_blob_detector({.min_roundness = 1.5}, PixelFormat::Mono8, 64, 64).error().code,
            ErrorCode::InvalidArgument);
  EXPECT_EQ(make_blob_detector({.grow_px = 9}, PixelFormat::Mono8, 64, 64).error().code, ErrorCode::InvalidArgument);
}

}  // namespace blob_detector_test
}  // namespace mocap::detect
