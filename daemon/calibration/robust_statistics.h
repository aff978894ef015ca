#pragma once

#include <algorithm>
#include <vector>

namespace mocap::calibration {

/// The median; the upper of the two middle values if their number is even. `values` must not be empty.
inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Median of the length of a two-dimensional residual whose axes have the standard deviation 1: the median of the
/// Rayleigh distribution, sqrt(2 ln 2). A median length divided by it is a robust standard deviation per axis.
inline constexpr double kRayleighMedian = 1.1774;

/// A residual longer than so many robust standard deviations is an outlier. With Rayleigh-distributed lengths that is
/// one correct observation in 25000.
inline constexpr double kOutlierSigmas = 4.5;

}  // namespace mocap::calibration
