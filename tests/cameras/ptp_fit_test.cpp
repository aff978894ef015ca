#include "cameras/ptp/ptp_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace mocap::cameras {
namespace ptp_fit_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kGrandmaster = 0x7adcdffffe341041;
constexpr double kRate = 40e-6;

Timestamp host(Duration since_begin) { return from_ns(1'000'000'000'000) + since_begin; }
Duration ptp_at(Timestamp at) {
  const Duration age = at - host({});
  return std::chrono::nanoseconds(1'795'772'164'700'852'004) + age + from_s(kRate * to_s(age));
}

TEST(PtpFit, FollowsAClockThatDrifts) {
  PtpFit fit;
  for (int i = 0; i < 40; ++i) fit.add(kGrandmaster, host(seconds(i)), ptp_at(host(seconds(i))));

  const auto line = fit.line(host(milliseconds(40'500)));

  ASSERT_TRUE(line);
  EXPECT_EQ(line->grandmaster, kGrandmaster);
  EXPECT_NEAR(line->rate, kRate, 1e-9);
  EXPECT_LE(std::abs((line->ptp - ptp_at(line->at)).count()), 2);
  EXPECT_LE(line->uncertainty, std::chrono::nanoseconds(5));
}

TEST(PtpFit, StatesItsErrorHonestly) {
  for (const double noise_s : {100e-9, 20e-6}) {
    double error_square = 0.0, stated_square = 0.0;
    for (std::uint64_t run = 0; run < 200; ++run) {
      std::mt19937_64 random(run);
      std::normal_distribution<> noise(0.0, noise_s);
      PtpFit fit;
      for (int i = 0; i < 20; ++i) {
        fit.add(kGrandmaster, host(seconds(i)), ptp_at(host(seconds(i))) + from_s(noise(random)));
      }
      const auto line = fit.line(host(milliseconds(19'700)));
      ASSERT_TRUE(line);
      error_square += std::pow(to_s(line->ptp - ptp_at(line->at)), 2);
      stated_square += std::pow(to_s(line->uncertainty), 2);
    }
    const double ratio = std::sqrt(error_square / stated_square);
    EXPECT_GT(ratio, 0.8) << noise_s;
    EXPECT_LT(ratio, 1.25) << noise_s;
  }
}

TEST(PtpFit, HasNoLineWithFewReadingsAndLongAfterTheLastOne) {
  PtpFit fit;
  for (int i = 0; i < 3; ++i) fit.add(kGrandmaster, host(seconds(i)), ptp_at(host(seconds(i))));
  EXPECT_FALSE(fit.line(host(seconds(3))));

  fit.add(kGrandmaster, host(seconds(3)), ptp_at(host(seconds(3))));

  EXPECT_TRUE(fit.line(host(seconds(4))));
  EXPECT_FALSE(fit.line(host(seconds(9))));
}

TEST(PtpFit, BeginsAnewWithAnotherGrandmaster) {
  PtpFit fit;
  for (int i = 0; i < 10; ++i) fit.add(kGrandmaster, host(seconds(i)), ptp_at(host(seconds(i))));

  fit.add(kGrandmaster + 1, host(seconds(10)), Duration{});

  EXPECT_FALSE(fit.line(host(seconds(10))));
}

TEST(PtpFit, LeavesOutAReadingThatIsNotNew) {
  PtpFit fit;
  for (int i = 0; i < 10; ++i) fit.add(kGrandmaster, host(seconds(7)), ptp_at(host(seconds(7))));

  EXPECT_FALSE(fit.line(host(seconds(7))));
}

}  // namespace ptp_fit_test
}  // namespace mocap::cameras
