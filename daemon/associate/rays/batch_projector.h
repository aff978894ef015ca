#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "model/bounds.h"

namespace mocap::associate {

struct ViewRays;

/// Where all views of a set would see one uncertain point: several views at a time, in single precision (to a
/// thousandth of a pixel). Never allocates.
class BatchProjector {
 public:
  struct Point {
    const Eigen::Vector3d& at;
    const Eigen::Matrix3d& covariance_m2;
    double sigmas;    ///< how far off a ray may be
    double floor_px;  ///< standard deviation that is added to those of point and ray
  };

  /// Takes in a view of the set, those of its rays listed that are looked for.
  void place(std::size_t view, const ViewRays& rays);

  /// The shadows of a point in the first `view_count` views.
  void cast(const Point& point, std::size_t view_count);

  /// The nearest of the view's rays to its shadow, in the gate, that is not taken.
  std::optional<std::size_t> nearest_unassigned(std::size_t view, const ViewRays& rays) const;

 private:
  // Full registers of up to 16 numbers; what lies past the views means nothing.
  static constexpr std::size_t kLanes = 16;
  template <class T>
  using Column = std::array<T, (kMaxCameras + kLanes - 1) / kLanes * kLanes>;

  // Of the cameras: the rows x, y and depth, each by the point's x, y, z and 1; and of their views' bins.
  std::array<Column<float>, 12> rows_{};
  Column<float> min_x_{}, min_y_{}, per_x_{}, per_y_{}, last_bin_{};
  Column<float> typical_variance_{};  // of the rays, on the image plane at distance 1: others reach farther
  Column<float> plane_from_px_{};

  Column<float> x_{}, y_{}, xx_{}, xy_{}, yy_{}, depth_m_{}, floor2_{};  // as Foreseen has them
  Column<std::int32_t> left_{}, right_{}, top_{}, bottom_{};             // the gate, as RayBins::Gate
  float gate2_ = 0.0F;
};

}  // namespace mocap::associate
