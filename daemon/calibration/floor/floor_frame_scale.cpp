#include "calibration/floor/floor_frame_scale.h"

#include <cmath>

namespace mocap::calibration {
namespace {

constexpr double kProportionTolerance = 0.01;
constexpr double kMaxCosine = 0.0175;  // 89 degrees
constexpr double kMinScale = 0.5;
constexpr double kMaxScale = 2.0;

}  // namespace

std::optional<double> floor_frame_scale(std::span<const Eigen::Vector3d> points_m, const FloorFrame& frame) {
  std::optional<double> scale;
  for (std::size_t corner = 0; corner < points_m.size(); ++corner) {
    for (std::size_t far = 0; far < points_m.size(); ++far) {
      for (std::size_t near = 0; near < points_m.size(); ++near) {
        if (corner == far || corner == near || far == near) continue;
        const Eigen::Vector3d long_arm = points_m[far] - points_m[corner];
        const Eigen::Vector3d short_arm = points_m[near] - points_m[corner];
        const double by_long = long_arm.norm() / frame.long_m;
        const double by_short = short_arm.norm() / frame.short_m;
        const double cosine = std::abs(long_arm.dot(short_arm)) / (long_arm.norm() * short_arm.norm());
        if (std::abs(by_long / by_short - 1.0) > kProportionTolerance || cosine > kMaxCosine || by_long < kMinScale ||
            by_long > kMaxScale)
          continue;
        if (scale) return std::nullopt;
        scale = by_long;
      }
    }
  }
  return scale;
}

}  // namespace mocap::calibration
