#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "associate/predicted/ray_assignments.h"
#include "associate/rays/view_rays.h"
#include "geometry/triangulation.h"
#include "model/bounds.h"
#include "model/sighting.h"

namespace mocap::associate {

/// Triangulates all predicted markers together, view by view, several markers at a time with SIMD instructions.
///
/// The image error times the depth is linear in the point. With the depth fixed at the predicted position, the weighted
/// sum of squared errors is a quadratic form, and its minimum is the solution of one 3x3 system (one step of
/// iteratively reweighted linear triangulation, Hartley and Sturm, Triangulation, CVIU 1997; the same equations as
/// geometry::agree). One step suffices for nearly all markers. A marker whose rays do not agree, or that lies farther
/// from its prediction than 1 % of a depth, is left to geometry::agree. Never allocates after construction.
///
/// For each set: `begin`, `add` each view, `solve`, `classify_outliers`.
class BatchTriangulator {
 public:
  BatchTriangulator(std::size_t max_markers, std::size_t max_views);

  /// Begins a set of at most `max_markers` predicted markers.
  void begin(const Predictions& predicted);
  /// Adds one view with the rays assigned to the markers. Each view once.
  void add(const ViewRays& view, const RayAssignments& assigned);
  /// Solves the points of all markers.
  void solve();
  /// Counts the rays of each marker that do not agree with its point.
  void classify_outliers(const geometry::Agreement& agreement);

  /// The number of rays of a marker.
  std::size_t ray_count(std::size_t marker) const { return static_cast<std::size_t>(count_[marker]); }
  /// Whether all rays of a marker agree on one point.
  bool rays_agree(std::size_t marker) const { return is_observable_[marker] > 0.0 && outlier_count_[marker] == 0.0F; }
  /// The point of a marker. Precondition: its rays agree, or reject_outliers() succeeded.
  geometry::Refined triangulation(std::size_t marker) const;

  /// Adds one more ray to a marker; `reject_outliers` must follow.
  void add_ray(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray);
  /// Removes the worst ray of a marker from its normal equations (downdating) until the remaining rays agree, as
  /// geometry::agree does. Returns the views of the removed rays, one bit each. Returns nothing if no more than 8 rays
  /// are left or the point is not observable; the marker must then be solved by geometry::agree.
  std::optional<std::uint64_t> reject_outliers(std::size_t marker, const geometry::Agreement& agreement);

 private:
  using Column = std::vector<double>;
  using Floats = std::vector<float>;

  void gather(const ViewRays& view, const RayAssignments& assigned);
  void add_gathered(const ViewRays& view);
  void solve(std::size_t first, std::size_t end);
  struct Worst {
    std::size_t view;
    float excess2, sum_px2;
  };
  void load_errors(std::size_t marker);
  Worst worst(std::size_t marker, const geometry::Agreement& agreement);
  void update_sums(std::size_t marker, std::size_t view, float times);
  float* error(std::size_t view, std::size_t column) {
    return errors_.data() + (view * kErrorColumns + column) * lane_count_;
  }

  // Loops run over whole SIMD registers; entries past the last marker have no rays.
  static constexpr std::size_t kLanesAtOnce = 8;

  std::size_t marker_count_ = 0;
  std::size_t lane_count_ = 0;
  std::size_t view_count_ = 0;
  // By marker: predicted position; normal equations (xx xy xz yy yz zz of the information matrix, then the gradient);
  // displacement of the point from the prediction, and its covariance. Errors are computed in double precision, weights
  // and sums in single precision.
  std::array<Column, 3> start_;
  std::array<Floats, 9> sum_;
  std::array<Column, 3> displacement_;
  std::array<Column, 6> covariance_;
  Column is_observable_;  // 1: the rays determine the point, and it is near the prediction
  Floats count_;          // number of rays
  Floats min_depth_m_;
  Floats outlier_count_;  // number of rays that do not agree
  Floats sum_px2_;        // sum of squared errors
  // The ray of one view, by marker: position, Jacobian px_from_ray, variance (0: no ray).
  Column x_, y_;
  Floats ux_, uy_, vx_, vy_, variance_px2_;
  // The errors of all views, by marker: u at the predicted position and its derivatives by x, y and z, the same of v,
  // and the variance, px. Single precision suffices because the errors are small.
  static constexpr std::size_t kErrorColumns = 9;
  Floats errors_;
  // The errors of one marker, by view.
  std::array<std::array<float, kMaxCameras>, kErrorColumns> loaded_errors_{};
};

}  // namespace mocap::associate
