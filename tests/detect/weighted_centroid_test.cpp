#include "detect/centroid/weighted_centroid.h"

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>

namespace mocap::detect {
namespace weighted_centroid_test {

/// Random sums, also such as no disc has.
IntensitySums random_sums(std::mt19937& random) {
  const auto up_to = [&random](int most) {
    return static_cast<std::int64_t>(random() % static_cast<std::uint32_t>(most + 1));
  };
  IntensitySums intensity;
  intensity.middle_x = static_cast<int>(up_to(1000));
  intensity.middle_y = static_cast<int>(up_to(1000));
  intensity.begin_x = intensity.middle_x - 8;
  intensity.begin_y = intensity.middle_y - 8;
  intensity.end_x = intensity.middle_x + 8;
  intensity.end_y = intensity.middle_y + 8;
  intensity.bright = static_cast<std::uint32_t>(4 + up_to(100));
  intensity.peak = 200;
  intensity.span = static_cast<std::uint32_t>(1 + up_to(200));
  intensity.roundness = 0.01 * static_cast<double>(up_to(100));
  for (int power = 0; power < kPowers; ++power) {
    intensity.sums.weight[power] = (power == 0 ? 1 : 0) + up_to(kFullWeight * 80 / (power + 1));
    intensity.sums.x[power] = up_to(40000) - 20000;
    intensity.sums.y[power] = up_to(40000) - 20000;
  }
  intensity.sums.slope2 = up_to(40000);
  return intensity;
}

bool same_bits(const MeasuredBlob& a, const MeasuredBlob& b) {
  const auto figures = [](const MeasuredBlob& each) {
    return std::array{each.blob.centroid.v.x(), each.blob.centroid.v.y(), each.blob.sigma_px,
                      each.blob.area_px2,       each.blob.peak,           each.blob.saturated,
                      each.blob.roundness,      each.radius_px,           each.edge_px};
  };
  const auto of_a = figures(a), of_b = figures(b);
  return std::memcmp(of_a.data(), of_b.data(), sizeof(of_a)) == 0;
}

TEST(WeightedCentroid, DoesNotDependOnTheOtherLanes) {
  std::mt19937 random(1);
  const GreyLevels grey_levels{40, 255, 12.0, 3.0, std::nullopt};
  for (std::size_t count = 1; count <= kBlobLanes; ++count) {
    std::array<IntensitySums, kBlobLanes> intensity_sums;
    for (IntensitySums& intensity : intensity_sums) intensity = random_sums(random);
    std::array<MeasuredBlob, kBlobLanes> found;

    measure_blobs(grey_levels, std::span(intensity_sums).first(count), found);

    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_TRUE(same_bits(found[i], measure_blob(grey_levels, intensity_sums[i]))) << count << " blobs, blob " << i;
    }
  }
}

TEST(WeightedCentroid, LiesInTheBoxWithoutItsPadding) {
  std::mt19937 random(1);
  const GreyLevels grey_levels{40, 255, 12.0, 3.0, std::nullopt};
  int outside = 0;
  for (int i = 0; i < 1000; ++i) {
    IntensitySums padded = random_sums(random), narrow = padded;
    narrow.sums.x[0] = padded.sums.x[0] = -7 * padded.sums.weight[0];  // the mean weighted by u is in the narrow box
    narrow.end_x = narrow.middle_x - 6;

    const double x_padded = measure_blob(grey_levels, padded).blob.centroid.v.x();
    const double x_narrow = measure_blob(grey_levels, narrow).blob.centroid.v.x();

    outside += x_padded > narrow.end_x - 0.5 ? 1 : 0;
    EXPECT_LE(x_narrow, narrow.end_x - 0.5);
    EXPECT_GE(x_narrow, narrow.begin_x - 0.5);
  }
  EXPECT_GT(outside, 0) << "no sums with a cubic centroid in the padding";
}

}  // namespace weighted_centroid_test
}  // namespace mocap::detect
