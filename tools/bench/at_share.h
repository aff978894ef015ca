#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace mocap::bench {

/// The value below which the given share of the values lies: 0.5 gives the median. 0 without values.
inline double at_share(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

}  // namespace mocap::bench
