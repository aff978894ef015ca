#include "export/clip/rates.h"

#include <cmath>
#include <cstdio>
#include <numeric>
#include <string>

namespace mocap::exports {
namespace {

// 29.97 is written for 30000/1001 = 29.97003, a relative difference of 1e-6; so are 23.976 and 59.94. The next rate in
// steps of 0.001 Hz is 4e-6 away at 240 Hz.
constexpr double kSameRate = 2e-6;

// So that products of two rates and a frame number fit into 64 bits.
constexpr long long kMaxNumerator = 10'000'000, kMaxDenominator = 10'000;

Rate reduced(std::int64_t numerator, std::int64_t denominator) {
  const std::int64_t common = std::gcd(numerator, denominator);
  return {numerator / common, denominator / common};
}

}  // namespace

Rate rate_of(double hz) {
  const double whole = std::round(hz * 1.001);
  if (hz != std::round(hz) && std::abs(hz * 1.001 / whole - 1.0) < kSameRate) {
    return reduced(static_cast<std::int64_t>(whole) * 1000, 1001);
  }
  return reduced(std::llround(hz * 1000.0), 1000);
}

std::optional<Rate> parse_rate(std::string_view text) {
  const std::string copy(text);
  long long numerator = 0, denominator = 0;
  double hz = 0.0;
  char more = 0;
  Rate rate;
  if (std::sscanf(copy.c_str(), "%lld/%lld%c", &numerator, &denominator, &more) == 2 && numerator > 0 &&
      numerator <= kMaxNumerator && denominator > 0 && denominator <= kMaxDenominator) {
    rate = {numerator, denominator};
  } else if (std::sscanf(copy.c_str(), "%lf%c", &hz, &more) == 1 && hz >= 1.0 && hz <= 1e4) {
    rate = rate_of(hz);
  } else {
    return std::nullopt;
  }
  if (!(rate.hz() >= 1.0 && rate.hz() <= 1e4)) return std::nullopt;
  return rate;
}

}  // namespace mocap::exports
