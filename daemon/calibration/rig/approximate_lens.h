#pragma once

#include "model/camera_model.h"

namespace mocap::calibration {

/// A lens of which only the horizontal field of view is known.
struct ApproximateLens {
  double fov_deg = 60.0;
  LensKind kind = LensKind::Pinhole;
};

/// The intrinsics of such a lens without distortion, with its optical axis in the middle of the image.
Lens lens_of(const ApproximateLens& approximate, int width_px, int height_px);

}  // namespace mocap::calibration
