#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The ray that a pixel sees, and how the pixel moves when the ray turns a little.
struct Ray {
  NormalizedPoint point;
  Eigen::Matrix2d px_from_ray;  ///< derivative of the pixel by the ray, px; carries errors on the ray back to px
};

/// Turns pixels of one camera into rays, lens distortion undone to 1e-6 px.
///
/// A table of rays over the image with bicubic Hermite interpolation between them and one step of Newton's from there,
/// as coarse as that precision allows (checked in the middle of each cell when it is built); outside of the image, and
/// where the lens bends too sharply for the table, Newton's iteration. Never allocates after construction; any thread.
class RayCaster {
 public:
  explicit RayCaster(const CameraModel& camera);

  /// Nothing where no ray leads to that pixel.
  std::optional<Ray> cast(const PixelPoint& pixel) const;

 private:
  // A ray of the grid, and its derivatives by the pixel in units of the grid's step.
  struct Node {
    Eigen::Vector2d ray, by_x, by_y, by_xy;
  };

  Node node_at(const PixelPoint& pixel) const;
  void build(int width_px, int height_px, double step_px);
  bool is_precise();
  std::optional<Ray> look_up(const PixelPoint& pixel) const;

  Lens lens_;
  double step_px_ = 0.0;
  int columns_ = 0;  // of cells
  int rows_ = 0;
  std::vector<Node> nodes_;  // rows_ + 1 times columns_ + 1; NaN where there is no ray
};

}  // namespace mocap::geometry
