#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The ray of a pixel on the image plane at distance 1, and the derivative of the pixel by the ray.
struct Ray {
  NormalizedPoint point;
  Eigen::Matrix2d px_from_ray;  ///< derivative of the pixel by the ray, px; converts errors of the ray to px
};

/// The ray of a pixel by Newton's method, without a table; nothing if no ray maps to the pixel.
std::optional<Ray> ray_of(const Lens& lens, const PixelPoint& pixel);

/// Many rays as columns, so that loops use SIMD instructions.
struct RayColumns {
  std::vector<double> x, y;
  std::vector<double> ux, uy, vx, vy;  ///< px_from_ray: derivatives of the pixel's u and v by the ray's x and y
  std::vector<std::uint8_t> exists;    ///< 0: no ray maps to the pixel, and the other columns have no meaning

  explicit RayColumns(std::size_t max_rays);
  void resize(std::size_t rays);
  Ray operator[](std::size_t i) const;
  /// Removes the rays that do not exist. The others keep their order.
  void drop_missing();
};

/// Converts pixels of one camera to rays and corrects lens distortion to 1e-6 px.
///
/// Pinhole: a table of the radial distortion by the squared distance from the axis gives an initial ray, from which the
/// tangential distortion is subtracted. Newton steps with the exact derivative follow, as many as the precision
/// requires (one for usual lenses; the constructor tests the whole image). Newton's method without a table is used
/// outside the image, where the distortion folds the image over, and for fisheye lenses. Never allocates after
/// construction. Any thread.
class RayCaster {
 public:
  explicit RayCaster(const CameraModel& camera);

  /// Computes the rays of all pixels. Precondition: `into` has capacity for them.
  void cast(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const;

 private:
  void tabulate();
  bool is_precise() const;
  bool is_in_table(double u_px, double v_px) const;
  bool look_up(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const;
  bool polish(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const;

  Lens lens_;
  double width_px_;
  double height_px_;
  int steps_ = 0;              // number of Newton steps; 0: no table
  std::vector<double> scale_;  // length of the ray over that of the distorted ray, by the latter squared
  double cells_per_length2_ = 0.0;
};

}  // namespace mocap::geometry
