#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The ray that a pixel sees, and how the pixel moves when the ray turns a little.
struct Ray {
  NormalizedPoint point;
  Eigen::Matrix2d px_from_ray;  ///< derivative of the pixel by the ray, px; carries errors on the ray back to px
};

/// By Newton's iteration, without a table; nothing where no ray leads to that pixel.
std::optional<Ray> ray_of(const Lens& lens, const PixelPoint& pixel);

/// Many rays, a column for each number, so that loops over them run several at a time.
struct RayColumns {
  std::vector<double> x, y;
  std::vector<double> ux, uy, vx, vy;  ///< px_from_ray: of the pixel's u and v by the ray's x and y
  std::vector<std::uint8_t> exists;    ///< 0: no ray leads to that pixel, the other columns mean nothing

  explicit RayColumns(std::size_t max_rays);
  void resize(std::size_t rays);
  Ray operator[](std::size_t i) const;
  /// Takes those out that do not exist; the others keep their order.
  void drop_missing();
};

/// Turns pixels of one camera into rays, lens distortion undone to 1e-6 px.
///
/// Pinhole: a table of the lens's radial part by the squared distance from the axis, the tangential part taken off at
/// that guess, and as many steps of Newton's with the exact slope as the precision asks (one for usual lenses; checked
/// all over the image when the caster is built). Outside of the image, where the lens folds the image over, and for
/// fisheyes: Newton's iteration. Never allocates after construction; any thread.
class RayCaster {
 public:
  explicit RayCaster(const CameraModel& camera);

  /// The rays of all these pixels. `into` has had room for as many.
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
  int steps_ = 0;              // of Newton's; 0: no table
  std::vector<double> scale_;  // ray over distorted ray, by the squared length of the distorted ray
  double cells_per_length2_ = 0.0;
};

}  // namespace mocap::geometry
