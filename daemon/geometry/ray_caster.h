#pragma once

#include <Eigen/Core>
#include <optional>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The ray that a pixel sees, and how the pixel moves when the ray turns a little.
struct Ray {
  NormalizedPoint point;
  Eigen::Matrix2d px_from_ray;  ///< derivative of the pixel by the ray, px; carries errors on the ray back to px
};

/// Turns pixels of one camera into rays, lens distortion undone to 1e-9 of the image plane at distance 1.
///
/// Nothing where no ray leads to that pixel. Never allocates after construction; any thread, as long as the lens it was
/// made for is not asked to change.
class RayCaster {
 public:
  explicit RayCaster(const Lens& lens) : lens_(lens) {}

  std::optional<Ray> cast(const PixelPoint& pixel) const;

 private:
  Lens lens_;
};

}  // namespace mocap::geometry
