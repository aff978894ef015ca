#include "cameras/clock/exposure_clock.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

namespace mocap::cameras {
namespace exposure_clock_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kPeriod = milliseconds(10);
constexpr Duration kUtcMinusHost = seconds(1'700'000'000);

/// A camera at 100 Hz whose clock follows UTC until lose_master(). An image arrives 300 us after its exposure plus an
/// exponential delay.
class Exposing {
 public:
  explicit Exposing(double jitter_us) : late_(1.0 / jitter_us) {}

  ImageInstants next(Duration exposure) {
    begin_ += kPeriod;
    if (drifts_) drifted_ += drifted_per_image_;
    ImageInstants image{};
    image.stamp = begin_.time_since_epoch() + kUtcMinusHost + drifted_;
    image.exposure = exposure;
    image.stamp_tells_begin = true;
    image.first_byte = begin_ + exposure + microseconds(300) + from_s(1e-6 * late_(random_));
    image.received = image.first_byte + milliseconds(1);
    image.utc_minus_host = kUtcMinusHost;
    middle_ = begin_ + exposure / 2;
    return image;
  }
  void lose_master(double drift_ppm) {
    drifts_ = true;
    drifted_per_image_ = from_s(1e-6 * drift_ppm * to_s(kPeriod));
  }
  Timestamp middle() const { return middle_; }

 private:
  std::mt19937_64 random_{7};
  std::exponential_distribution<> late_;
  Timestamp begin_ = from_ns(1'000'000'000);
  Timestamp middle_;
  Duration drifted_{}, drifted_per_image_{};
  bool drifts_ = false;
};

AravisSettings by(const char* clock) {
  AravisSettings settings;
  settings.clock = clock;
  return settings;
}

TEST(ExposureClock, EstimatesTheMiddleOfExposuresOfAnyLengthFromTheReceipts) {
  AravisSettings settings = by("estimated");
  settings.delivery_us = 300.0;
  ExposureClock clock("north", settings);
  Exposing camera(20.0);

  Duration worst{};
  for (int i = 0; i < 2000; ++i) {
    const Timestamp estimated = clock.middle_of(camera.next(microseconds(200 + 150 * (i % 12))), true);
    if (i >= 1000) worst = std::max(worst, std::chrono::abs(estimated - camera.middle()));
  }

  // The jitter of 20 us is averaged out; the exposure of another image would give an error of up to 800 us.
  EXPECT_LT(worst, microseconds(10));
  EXPECT_EQ(clock.source(), ClockSource::Receipts);
}

TEST(ExposureClock, GoesOnWithoutAJumpWhenTheCameraLosesItsMaster) {
  ExposureClock clock("north", by("utc"));
  Exposing camera(100.0);
  for (int i = 0; i < 1000; ++i) {
    const Timestamp estimated = clock.middle_of(camera.next(microseconds(500)), true);
    EXPECT_EQ(estimated, camera.middle());
  }
  EXPECT_EQ(clock.source(), ClockSource::Camera);
  EXPECT_EQ(clock.uncertainty(), Duration::zero());

  camera.lose_master(50.0);
  Duration worst{};
  for (int i = 0; i < 1000; ++i) {
    const Timestamp estimated = clock.middle_of(camera.next(microseconds(500)), false);
    worst = std::max(worst, std::chrono::abs(estimated - camera.middle()));
  }

  // At the end the camera's clock is off by 500 us; images arrive at least 300 us late.
  EXPECT_LT(worst, microseconds(60));
  EXPECT_EQ(clock.source(), ClockSource::Lost);
  EXPECT_GT(clock.uncertainty(), Duration::zero());
}

TEST(ExposureClock, AcceptsACameraThatCountsTaiAndRejectsOneThatCountsFromItsStart) {
  ExposureClock tai("north", by("utc")), own("south", by("utc"));
  Exposing camera(20.0);
  for (int i = 0; i < 10; ++i) {
    ImageInstants image = camera.next(microseconds(500));
    image.stamp += seconds(37);
    EXPECT_EQ(tai.middle_of(image, true), camera.middle());
    image.stamp -= kUtcMinusHost;
    EXPECT_GT(own.middle_of(image, true), camera.middle());
  }
  EXPECT_EQ(tai.source(), ClockSource::Camera);
  EXPECT_EQ(own.source(), ClockSource::Lost);
}

}  // namespace exposure_clock_test
}  // namespace mocap::cameras
