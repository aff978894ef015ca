#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/ray_caster.h"
#include "geometry/triangulation.h"
#include "model/camera_model.h"
#include "model/sighting.h"

namespace mocap::stages {

/// Where a camera would see an uncertain point: on the image plane at distance 1.
struct Shadow {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// What one camera saw, as rays in the order of their x.
struct ViewRays {
  const CameraModel* camera = nullptr;
  double focal_px = 1.0;
  std::vector<double> x;
  std::vector<double> y;
  std::vector<Eigen::Matrix2d> px_from_ray;
  std::vector<double> sigma_px;   ///< with the doubt that the blob's shape casts
  std::vector<double> spread_px;  ///< over 0: more than one marker is likely in the blob, so far from its centroid
  /// Where there is a spread: its direction, twice the angle of the longer axis as a unit vector; zero: not told.
  std::vector<Eigen::Vector2d> axis;
  std::vector<std::uint16_t> blob;  ///< index in the BlobFrame
  std::vector<std::uint8_t> taken;  ///< how many matches it belongs to

  std::size_t size() const { return x.size(); }
  geometry::Sighting sighting(std::size_t ray, std::uint32_t source) const;
  /// Where the ray points to in the world; unit.
  Eigen::Vector3d direction(std::size_t ray) const;

  /// Where the camera would see the point; nothing where it is not in front of it.
  std::optional<Shadow> shadow(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2) const;
  /// Squared distance of a ray from a shadow in standard deviations of both, `floor_px` added to them.
  double distance2(const Shadow& shadow, std::size_t ray, double floor_px) const;
  /// The rays whose x lies in the shadow's gate of `sigmas`: first and past-the-last.
  std::pair<std::size_t, std::size_t> candidates(const Shadow& shadow, double sigmas, double floor_px) const;
  /// The rays whose x lies from `low` to `high`.
  std::pair<std::size_t, std::size_t> between(double low, double high) const;
  double max_spread_px() const { return max_spread_px_; }
  /// The nearest ray in the gate that is not taken.
  std::optional<std::size_t> nearest_free(const Shadow& shadow, double sigmas, double floor_px) const;

 private:
  friend class RayTable;
  static constexpr std::size_t kBins = 64;

  std::size_t bin_of(double at_x) const {
    const double bin = (at_x - x_min_) * bins_per_x_;
    return bin > 0.0 ? std::min(static_cast<std::size_t>(std::min(bin, 1e6)), kBins - 1) : 0;
  }
  void index();

  double max_sigma_px_ = 0.0;
  double max_spread_px_ = 0.0;
  // Where to begin looking for an x: cheaper than a binary search, whose branches nobody can foretell.
  double x_min_ = 0.0;
  double bins_per_x_ = 0.0;
  std::array<std::uint16_t, kBins> first_of_bin_{};
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

  struct Cast {
    geometry::Ray ray;
    double sigma_px;
    double spread_px;
    Eigen::Vector2d axis;
    std::uint16_t blob;
  };
  std::vector<Cast> scratch_;
  std::vector<double> areas_;
};

}  // namespace mocap::stages
