#include "calibration/floor/frame_size.h"

#include <cmath>

namespace mocap::calibration {

std::optional<double> frame_times_larger(std::span<const Eigen::Vector3d> points_m, const FloorFrame& frame) {
  std::optional<double> times;
  for (std::size_t corner = 0; corner < points_m.size(); ++corner) {
    for (std::size_t far = 0; far < points_m.size(); ++far) {
      for (std::size_t near = 0; near < points_m.size(); ++near) {
        if (corner == far || corner == near || far == near) continue;
        const Eigen::Vector3d longer = points_m[far] - points_m[corner];
        const Eigen::Vector3d shorter = points_m[near] - points_m[corner];
        const double by_long = longer.norm() / frame.long_m;
        const double by_short = shorter.norm() / frame.short_m;
        const double lean = std::abs(longer.dot(shorter)) / (longer.norm() * shorter.norm());
        if (std::abs(by_long / by_short - 1.0) > 0.01 || lean > 0.0175 || by_long < 0.5 || by_long > 2.0) continue;
        if (times) return std::nullopt;
        times = by_long;
      }
    }
  }
  return times;
}

}  // namespace mocap::calibration
