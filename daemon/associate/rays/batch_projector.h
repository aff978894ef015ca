#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "model/bounds.h"

namespace mocap::associate {

struct ViewRays;

/// Projects one uncertain point into all views of a set and finds the nearest unassigned ray of a view.
///
/// The projection of the covariance is first order. All views are computed together with SIMD instructions in single
/// precision, which is accurate to a thousandth of a pixel. Never allocates.
class BatchProjector {
 public:
  struct Point {
    const Eigen::Vector3d& at;
    const Eigen::Matrix3d& covariance_m2;
    double sigmas;    ///< gate: the largest normalised distance of a ray
    double floor_px;  ///< standard deviation that is added to those of the point and the ray
  };

  /// Sets one view of the set. The candidates are the listed rays of the view.
  void place(std::size_t view, const ViewRays& rays);

  /// Projects a point into the first `view_count` views.
  void cast(const Point& point, std::size_t view_count);

  /// The unassigned ray of a view that is nearest to the projection (Mahalanobis distance) and inside the gate.
  std::optional<std::size_t> nearest_unassigned(std::size_t view, const ViewRays& rays) const;

 private:
  // The columns fill whole SIMD registers of up to 16 numbers; values past the views are unused.
  static constexpr std::size_t kLanes = 16;
  template <class T>
  using Column = std::array<T, (kMaxCameras + kLanes - 1) / kLanes * kLanes>;

  // By view: the rows x, y and depth of the projection matrix (coefficients of x, y, z and 1), and the scale of the
  // bins.
  std::array<Column<float>, 12> rows_{};
  Column<float> min_x_{}, min_y_{}, per_x_{}, per_y_{}, last_bin_{};
  Column<float> typical_variance_{};  // of the rays, on the image plane at distance 1
  Column<float> plane_from_px_{};

  Column<float> x_{}, y_{}, xx_{}, xy_{}, yy_{}, depth_m_{};  // by view: mean, covariance, depth
  Column<std::int32_t> left_{}, right_{}, top_{}, bottom_{};  // by view: the gate, as RayBins::Gate
  float gate2_ = 0.0F;
};

}  // namespace mocap::associate
