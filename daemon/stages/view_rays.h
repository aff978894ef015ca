#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/ray_caster.h"
#include "geometry/ray_quadric.h"
#include "model/camera_model.h"
#include "model/sighting.h"

namespace mocap::stages {

/// Where a camera would see an uncertain point: on the image plane at distance 1.
struct Shadow {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// What one camera saw, as rays in the order of its blobs.
struct ViewRays {
  const CameraModel* camera = nullptr;
  double focal_px = 1.0;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<Eigen::Matrix2d> px_from_ray;
  std::vector<RayQuadric> quadric;  ///< with sigma_px
  std::vector<double> sigma_px;     ///< with the doubt that the blob's shape casts
  std::vector<double> spread_px;    ///< over 0: more than one marker is likely in the blob, so far from its centroid
  /// Where there is a spread: its direction, twice the angle of the longer axis as a unit vector; zero: not told.
  std::vector<Eigen::Vector2d> axis;
  std::vector<std::uint16_t> blob;  ///< index in the BlobFrame
  std::vector<std::uint8_t> taken;  ///< how many matches it belongs to

  std::size_t size() const { return x.size(); }
  geometry::QuadricSighting sighting(std::size_t ray, std::uint32_t source) const {
    return {&quadric[ray], &camera->camera_from_world, sigma_px[ray], 1.0, source};
  }
  /// Where the ray points to in the world; unit.
  Eigen::Vector3d direction(std::size_t ray) const;

  /// Where the camera would see the point; nothing where it is not in front of it.
  std::optional<Shadow> shadow(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2) const;
  /// Squared distance of a ray from a shadow in standard deviations of both, `floor_px` added to them.
  double distance2(const Shadow& shadow, std::size_t ray, double floor_px) const;
  /// What the least certain ray and `floor_px` add to the variance of a shadow.
  double most_own(double floor_px) const {
    return (max_sigma_px_ * max_sigma_px_ + floor_px * floor_px) / (focal_px * focal_px);
  }
  /// Calls `visit` with each ray that is at most `half_x` and `half_y` off a place, and a few others near it.
  template <class Visit>
  void near(double at_x, double at_y, double half_x, double half_y, Visit&& visit) const {
    const double low_x = (at_x - half_x - min_x_) * cells_per_x_;
    const double high_x = (at_x + half_x - min_x_) * cells_per_x_;
    const double low_y = (at_y - half_y - min_y_) * cells_per_y_;
    const double high_y = (at_y + half_y - min_y_) * cells_per_y_;
    const double side = static_cast<double>(side_);
    if (!(high_x >= 0.0 && high_y >= 0.0 && low_x <= side && low_y <= side)) return;
    const std::size_t first_column = cell_of(low_x);
    const std::size_t last_column = cell_of(high_x);
    const std::size_t last_row = cell_of(high_y);
    for (std::size_t row = cell_of(low_y); row <= last_row; ++row) {
      const std::uint16_t* const first = &first_of_cell_[row * side_ + first_column];
      const std::uint16_t* const last = &first_of_cell_[row * side_ + last_column + 1];
      for (std::size_t k = *first; k < *last; ++k) visit(std::size_t{ray_of_cell_[k]});
    }
  }
  double max_spread_px() const { return max_spread_px_; }
  /// The nearest ray to the shadow of a point, in the gate, that is not taken.
  std::optional<std::size_t> nearest_free(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2,
                                          double sigmas, double floor_px) const;
  /// Makes `near` ready, when all rays are there.
  void index();

 private:
  friend class RayTable;
  static constexpr std::size_t kMostSide = 24;

  std::size_t cell_of(double at) const {
    return at > 0.0 ? std::min(static_cast<std::size_t>(std::min(at, 1e6)), side_ - 1) : 0;
  }

  double max_sigma_px_ = 0.0;
  double max_spread_px_ = 0.0;
  // A grid of side_ by side_ cells over all rays, about one ray a cell.
  std::size_t side_ = 0;
  double min_x_ = 0.0;
  double min_y_ = 0.0;
  double cells_per_x_ = 0.0;
  double cells_per_y_ = 0.0;
  std::array<std::uint16_t, kMostSide * kMostSide + 1> first_of_cell_{};
  std::array<std::uint16_t, kMaxBlobs> ray_of_cell_{};
  std::array<std::uint16_t, kMaxBlobs> cell_of_ray_{};
};

/// The rays of all blobs of one frame set: undistorted once, then asked often. Never allocates after construction.
class RayTable {
 public:
  /// `rig` must outlive the table.
  explicit RayTable(const Rig& rig);

  /// Takes in a set. Views of cameras that the rig does not hold are empty; so are blobs that no ray leads to, or whose
  /// numbers are not finite.
  void cast(const FrameSet& frames);

  std::size_t view_count() const { return view_count_; }
  ViewRays& operator[](std::size_t view) { return views_[view]; }
  const ViewRays& operator[](std::size_t view) const { return views_[view]; }

  /// The view of a camera, or nothing when the set has none.
  std::optional<std::size_t> view_of(std::size_t camera) const;

  /// Whether the point lies in the image of this view's camera.
  bool could_see(std::size_t view, const WorldPoint& point) const;

 private:
  void cast_view(const BlobFrame& frame, ViewRays& rays);

  const Rig& rig_;
  std::vector<geometry::RayCaster> casters_;  // by camera
  std::vector<double> reach_;                 // by camera: no pixel's ray lies farther from the axis
  std::vector<ViewRays> views_;
  std::vector<std::uint32_t> view_of_;  // by camera
  std::size_t view_count_ = 0;

  std::vector<double> u_px_, v_px_, areas_px2_;
  geometry::RayColumns columns_;
};

}  // namespace mocap::stages
