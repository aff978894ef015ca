#pragma once

#include <optional>
#include <vector>

#include "calibration/wand/instants.h"
#include "calibration/wand/solve_wand.h"
#include "calibration/wand/two_view_geometry.h"

namespace mocap::calibration {

/// The wand in one image.
struct WandView {
  WandBlobs blobs{-1, -1, -1};
  WandRays rays;
};

/// The detected wand in every image of a recording. Keeps a pointer to the recording, which must outlive it.
struct WandDetections {
  const Take* recording = nullptr;
  std::vector<Instant> instants;
  std::vector<std::vector<std::optional<WandView>>> views;  ///< by camera, by instant

  /// Null if the camera has no image of this instant.
  const Picture* image(std::size_t camera, std::size_t instant) const;
};

/// Detects the wand in all images; rays are undistorted with the lenses of `rig`. Fails with WrongImageSize, TwoWands,
/// WrongWand, NoWand or StillWand.
Result<WandDetections, WandError> detect_wands(const Take& recording, const Rig& rig, const Wand& wand,
                                               const WandSettings& settings);

}  // namespace mocap::calibration
