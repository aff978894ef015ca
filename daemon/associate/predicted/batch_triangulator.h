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

/// Finds where the rays of many expected markers meet: all markers at once, view by view, several markers at a time.
///
/// Depth times error on the image plane is linear in the point. With the depths of the expected places, the sum of the
/// squared errors is a quadratic form, and one 3x3 system away is its least, as in geometry::agree. This does for
/// nearly all markers; those whose rays do not agree, or that lie farther from their expected place than 1 % of a
/// depth, are another's work. Never allocates after construction.
///
/// One set: `begin`, `add` each view, `solve`, `classify_outliers`.
class BatchTriangulator {
 public:
  BatchTriangulator(std::size_t max_markers, std::size_t max_views);

  void begin(const Expected& expected);
  /// `assigned`: the rays that are the markers'. Each view once.
  void add(const ViewRays& view, const RayAssignments& assigned);
  void solve();
  void classify_outliers(const geometry::Agreement& agreement);

  /// How many rays a marker has.
  std::size_t ray_count(std::size_t marker) const { return static_cast<std::size_t>(count_[marker]); }
  /// Whether all its rays agree on one point.
  bool rays_agree(std::size_t marker) const { return is_observable_[marker] > 0.0 && outlier_count_[marker] == 0.0F; }
  geometry::Refined triangulation(std::size_t marker) const;

  /// A ray of a view that was added is a marker's too; `reject_outliers` it then.
  void add_ray(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray);
  /// Leaves out the rays of a marker that are farthest off, one after the other, until the others agree, as
  /// geometry::agree does with more than 8: the views left out, a bit each. Nothing where so few agree, or none; then
  /// the marker is another's work for good.
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

  // Loops run over whole registers: what lies past the markers has no rays.
  static constexpr std::size_t kLanesAtOnce = 8;

  std::size_t marker_count_ = 0;
  std::size_t lane_count_ = 0;
  std::size_t view_count_ = 0;
  // By marker: where it is expected; the rays' sum (xx xy xz yy yz zz of the information, then the pull); how far from
  // there they meet, and the covariance of that. Errors are told in double precision; what they weigh in single.
  std::array<Column, 3> start_;
  std::array<Floats, 9> sum_;
  std::array<Column, 3> displacement_;
  std::array<Column, 6> covariance_;
  Column is_observable_;  // 1: the rays tell the point, and it is near enough
  Floats count_;          // of rays
  Floats min_depth_m_;
  Floats outlier_count_;  // how many rays disagree
  Floats sum_px2_;        // of the squared errors
  // The rays of one view, by marker: place, slope (px), sigma_px^2 (0: no ray).
  Column x_, y_;
  Floats ux_, uy_, vx_, vy_, variance_px2_;
  // The errors of all views, by marker: u and v where it is expected, how both change with the point's x, y and z, and
  // sigma_px^2. Small numbers, for which single precision will do.
  static constexpr std::size_t kErrorColumns = 9;
  Floats errors_;
  // Of one marker, by view.
  std::array<std::array<float, kMaxCameras>, kErrorColumns> loaded_errors_{};
};

}  // namespace mocap::associate
