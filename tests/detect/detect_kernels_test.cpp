#include "detect/kernels/detect_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <random>
#include <vector>

#include "detect/blob_detector.h"
#include "detect/centroid/blob_measurer.h"
#include "detect/components/image_components.h"

namespace mocap::detect {
namespace detect_kernels_test {

constexpr int kThreshold = 128;

/// An image whose last byte is its last pixel, so that a read past the last pixel is out of bounds.
struct Picture {
  int width_px = 1, height_px = 1;
  std::size_t stride_bytes = 1;
  std::vector<std::uint8_t> pixels;

  std::uint8_t& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * stride_bytes + static_cast<std::size_t>(x)];
  }
  Image image() const {
    return {std::as_bytes(std::span(pixels)), stride_bytes, width_px, height_px, PixelFormat::Mono8};
  }
};

int below(std::mt19937& random, int end) { return static_cast<int>(random() % static_cast<unsigned>(end)); }

Picture blank(std::mt19937& random, int trial) {
  Picture picture;
  picture.width_px = trial % 7 == 0 ? 1 : 1 + below(random, trial % 3 == 0 ? 125 : 70);
  picture.height_px = trial % 11 == 0 ? 1 : 1 + below(random, 24);
  picture.stride_bytes = static_cast<std::size_t>(picture.width_px + below(random, 7));
  picture.pixels.assign(picture.stride_bytes * static_cast<std::size_t>(picture.height_px - 1) +
                            static_cast<std::size_t>(picture.width_px),
                        static_cast<std::uint8_t>(kThreshold - 1));
  return picture;
}

/// Draws random shapes on a blank image: boxes that may touch the border, lines one pixel wide, noise of any density,
/// white images.
Picture random_picture(std::mt19937& random, int trial, Picture picture) {
  const int kind = trial % 6;
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      if (kind == 0 && below(random, 9) < trial / 6 % 10) picture.at(x, y) = 200;
      if (kind == 1) picture.at(x, y) = 255;
    }
  }
  for (int i = 0; kind >= 2 && i < 8; ++i) {
    const int x0 = below(random, picture.width_px), y0 = below(random, picture.height_px);
    const int x1 = std::min(picture.width_px, x0 + 1 + below(random, kind == 3 ? 1 : 20));
    const int y1 = std::min(picture.height_px, y0 + 1 + below(random, kind == 4 ? 1 : 9));
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) picture.at(x, y) = static_cast<std::uint8_t>(kThreshold + below(random, 128));
    }
  }
  return picture;
}

/// Area and bounding box of a component, which identify the component.
struct Flooded {
  int area = 0, left = 0, top = 0, right = 0, bottom = 0;
  auto operator<=>(const Flooded&) const = default;
};

Flooded flood(Picture& picture, int x, int y) {
  Flooded found{0, x, y, x, y};
  std::vector<std::pair<int, int>> open{{x, y}};
  picture.at(x, y) = 0;
  while (!open.empty()) {
    const auto [cx, cy] = open.back();
    open.pop_back();
    found = {found.area + 1, std::min(found.left, cx), std::min(found.top, cy), std::max(found.right, cx),
             std::max(found.bottom, cy)};
    for (int ny = std::max(0, cy - 1); ny <= std::min(picture.height_px - 1, cy + 1); ++ny) {
      for (int nx = std::max(0, cx - 1); nx <= std::min(picture.width_px - 1, cx + 1); ++nx) {
        if (picture.at(nx, ny) < kThreshold) continue;
        picture.at(nx, ny) = 0;
        open.emplace_back(nx, ny);
      }
    }
  }
  return found;
}

std::vector<Flooded> all_flooded(Picture picture, int least_area_px2) {
  std::vector<Flooded> found;
  for (int y = 0; y < picture.height_px; ++y) {
    for (int x = 0; x < picture.width_px; ++x) {
      if (picture.at(x, y) < kThreshold) continue;
      const Flooded each = flood(picture, x, y);
      found.push_back(each.area < least_area_px2 ? Flooded{} : each);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

void scan(const Picture& picture, const DetectKernels& kernels, BrightWords& words) {
  words.clear();
  ScanRows rows;
  rows.bytes = picture.image().bytes.data();
  rows.stride_bytes = picture.stride_bytes;
  rows.width_px = picture.width_px;
  rows.rows = picture.height_px;
  rows.threshold = kThreshold;
  kernels.scan_bytes(rows, words);
}

/// The components of at least `least_area_px2`, and one element without area or position for each smaller component.
std::vector<Flooded> joined(const Picture& picture, const DetectKernels& kernels, int least_area_px2,
                            ImageComponents& components) {
  scan(picture, kernels, components.room());
  components.join(static_cast<std::uint32_t>(least_area_px2), 1000000, 4096);
  std::vector<Flooded> found(components.too_small());
  for (std::size_t i = 0; i < components.count(); ++i) {
    const Shape shape = components.shape(i);
    found.push_back({static_cast<int>(shape.area_px2), shape.begin_x, shape.begin_y, shape.end_x - 1, shape.end_y - 1});
  }
  std::sort(found.begin(), found.end());
  return found;
}

/// Discs, rings, arcs and lamps up to the size of the image; lines in all directions, some longer than any marker.
Picture large_picture(std::mt19937& random) {
  Picture picture;
  picture.width_px = 200 + below(random, 300);
  picture.height_px = 150 + below(random, 150);
  picture.stride_bytes = static_cast<std::size_t>(picture.width_px + below(random, 7));
  picture.pixels.assign(picture.stride_bytes * static_cast<std::size_t>(picture.height_px), std::uint8_t{0});
  for (int i = 0; i < 12; ++i) {
    const int kind = below(random, 4), size = 2 + below(random, i % 3 == 0 ? 110 : 25);
    const int cx = below(random, picture.width_px), cy = below(random, picture.height_px);
    const int slope = below(random, 9) - 4, half_angle = below(random, size + 1);
    for (int y = std::max(0, cy - size); y < std::min(picture.height_px, cy + size); ++y) {
      for (int x = std::max(0, cx - size); x < std::min(picture.width_px, cx + size); ++x) {
        const int dx = x - cx, dy = y - cy, r2 = dx * dx + dy * dy;
        const bool on_ring = r2 <= size * size && r2 >= (size - 3) * (size - 3);
        const bool is_set = kind == 0   ? r2 <= size * size
                            : kind == 1 ? on_ring && dy < half_angle
                            : kind == 2 ? std::abs(4 * dx - slope * dy) < 6
                                        : std::abs(dx) < half_angle;
        if (is_set) picture.at(x, y) = 200;
      }
    }
  }
  return picture;
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof(a)) == 0; }

TEST(DetectKernels, FindTheComponentsThatAFloodFillFindsOnTenThousandImages) {
  std::mt19937 random(3);
  const auto all = all_kernels();
  // The buffers of an image size take longer to allocate than an image to scan.
  for (int size = 0; size < 500; ++size) {
    const Picture empty = blank(random, size);
    ImageComponents components(empty.width_px, empty.height_px, {});
    for (int trial = 20 * size; trial < 20 * (size + 1); ++trial) {
      const Picture picture = random_picture(random, trial, empty);
      const int least_area_px2 = 1 + trial % 4;

      const std::vector<Flooded> expected = all_flooded(picture, least_area_px2);

      for (const DetectKernels* kernels : all) {
        ASSERT_EQ(joined(picture, *kernels, least_area_px2, components) == expected, true)
            << kernels->name << " trial " << trial << " " << picture.width_px << "x" << picture.height_px;
      }
    }
  }
}

TEST(DetectKernels, FindTheComponentsThatAFloodFillFindsOnLargeImages) {
  std::mt19937 random(5);
  const auto all = all_kernels();
  for (int trial = 0; trial < 150; ++trial) {
    const Picture picture = large_picture(random);

    const std::vector<Flooded> expected = all_flooded(picture, 1);

    ImageComponents components(picture.width_px, picture.height_px, {});
    for (const DetectKernels* kernels : all) {
      ASSERT_EQ(joined(picture, *kernels, 1, components) == expected, true) << kernels->name << " trial " << trial;
    }
  }
}

/// The sums of runs that are added one by one.
RunSums added(std::span<const Run> runs) {
  RunSums sums{.begin_x = runs[0].begin, .begin_y = runs[0].y};
  for (const Run& run : runs) sums.add(run);
  return sums;
}

TEST(ImageComponents, HaveTheSumsOfTheirRuns) {
  std::mt19937 random(6);
  for (int trial = 0; trial < 50; ++trial) {
    const Picture picture = large_picture(random);
    ImageComponents components(picture.width_px, picture.height_px, {});
    scan(picture, best_kernels(), components.room());

    components.join(1, 1000000, 4096);

    int last_first_px = -1;
    for (std::size_t i = 0; i < components.count(); ++i) {
      const Shape shape = components.shape(i), expected = shape_of(added(components.runs(i)));
      ASSERT_TRUE(same_bits(shape.x, expected.x) && same_bits(shape.y, expected.y) &&
                  same_bits(shape.xx, expected.xx) && same_bits(shape.yy, expected.yy) &&
                  same_bits(shape.xy, expected.xy))
          << "trial " << trial << " component " << i;
      EXPECT_EQ(shape.begin_x, expected.begin_x);
      EXPECT_EQ(shape.end_x, expected.end_x);
      EXPECT_EQ(shape.begin_y, expected.begin_y);
      EXPECT_EQ(shape.end_y, expected.end_y);
      const detect::Run& first = components.runs(i)[0];
      const int first_px = first.y * picture.width_px + first.begin;
      EXPECT_GT(first_px, last_first_px);
      last_first_px = first_px;
    }
  }
}

TEST(DetectKernels, GiveBitIdenticalBlobs) {
  std::mt19937 random(4);
  const auto all = all_kernels();
  const DetectSettings settings{.threshold = 128.0, .min_area_px2 = 1.0, .max_area_px2 = 1e6, .min_roundness = 0.0};
  for (int size = 0; size < 100; ++size) {
    const Picture empty = blank(random, size);
    std::vector<std::unique_ptr<Detector>> detectors;
    for (const DetectKernels* kernels : all) {
      auto made = make_blob_detector(settings, PixelFormat::Mono8, empty.width_px, empty.height_px, {}, kernels);
      detectors.push_back(std::move(made).value());
    }
    for (int trial = 20 * size; trial < 20 * (size + 1); ++trial) {
      const Picture picture = random_picture(random, trial, empty);
      std::vector<Detection> found;
      for (const auto& detector : detectors) found.push_back(detector->detect(picture.image()));
      for (std::size_t k = 1; k < found.size(); ++k) {
        ASSERT_EQ(found[k].blobs.size(), found[0].blobs.size());
        for (std::size_t i = 0; i < found[k].blobs.size(); ++i) {
          const Blob& a = found[0].blobs[i];
          const Blob& b = found[k].blobs[i];
          ASSERT_TRUE(same_bits(a.centroid.v.x(), b.centroid.v.x()) && same_bits(a.centroid.v.y(), b.centroid.v.y()) &&
                      same_bits(a.sigma_px, b.sigma_px) && same_bits(a.peak, b.peak) &&
                      same_bits(a.saturated, b.saturated) && same_bits(a.area_px2, b.area_px2))
              << all[k]->name << " trial " << trial;
        }
      }
    }
  }
}

TEST(ImageComponents, KeepDenseRowsInOneQuarterOfTheImage) {
  // 300 discs of 20 rows in the first 256 of 1024 rows: 6000 runs, three times a quarter of the bound of 8192.
  constexpr int kWidth_px = 1280, kHeight_px = 1024, kDisc_px = 20;
  std::vector<std::uint8_t> pixels(std::size_t{kWidth_px} * kHeight_px, 0);
  for (int i = 0; i < 300; ++i) {
    for (int y = 0; y < kDisc_px; ++y) {
      for (int x = 0; x < kDisc_px; ++x) {
        pixels[static_cast<std::size_t>((2 + 24 * (i / 30) + y) * kWidth_px + 10 + 40 * (i % 30) + x)] = 255;
      }
    }
  }
  for (const DetectKernels* kernels : all_kernels()) {
    ImageComponents components(kWidth_px, kHeight_px, {});
    kernels->scan_bytes({std::as_bytes(std::span(pixels)).data(), kWidth_px, kWidth_px, kHeight_px, 0, 100},
                        components.room());

    components.join(1, 1000, kMaxBlobs);

    EXPECT_EQ(components.count(), 300U) << kernels->name;
    EXPECT_EQ(components.rows_given_up(), 0U) << kernels->name;
  }
}

TEST(ImageComponents, DropARowOfNoise) {
  std::vector<std::uint8_t> pixels(2 * 640, 0);
  for (std::size_t x = 0; x < 640; x += 2) pixels[x] = 255;
  for (std::size_t x = 100; x < 110; ++x) pixels[640 + x] = 255;
  for (const DetectKernels* kernels : all_kernels()) {
    ImageComponents components(640, 2, {});
    kernels->scan_bytes({std::as_bytes(std::span(pixels)).data(), 640, 640, 2, 0, 100}, components.room());

    components.join(1, 1000, 100);

    ASSERT_EQ(components.count(), 1U) << kernels->name;
    EXPECT_EQ(components.rows_given_up(), 1U);
    EXPECT_EQ(components.runs(0)[0].y, 1);
    EXPECT_EQ(components.runs(0)[0].begin, 100);
    EXPECT_EQ(components.runs(0)[0].end, 110);
  }
}

}  // namespace detect_kernels_test
}  // namespace mocap::detect
