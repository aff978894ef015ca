#pragma once

#include <optional>
#include <string>

#include "model/camera_model.h"

namespace mocap::calibration {

/// A lens of which only the horizontal field of view is known.
struct ApproximateLens {
  double fov_deg = 60.0;
  LensKind kind = LensKind::Pinhole;
};

/// The intrinsics of such a lens without distortion, with its optical axis in the middle of the image.
Lens lens_of(const ApproximateLens& approximate, int width_px, int height_px);

/// Whether a field of view is used for a camera: it has no lens, or one that came from a field of view.
bool takes_field_of_view(const CameraModel& camera);

/// A sentence with the cameras for which a given field of view is not used; nothing if it is used for all.
std::optional<std::string> lenses_that_are_kept(const Rig& rig);

}  // namespace mocap::calibration
