#pragma once

#include <optional>

#include "calibration/wand/wand_detections.h"

namespace mocap::calibration {

/// Initial extrinsics of all cameras in the frame of the first camera.
///
/// Estimates the relative pose of each pair of cameras that share enough samples, then joins the cameras along a
/// maximum spanning tree (Prim's algorithm). The weight of a pair is its number of inliers times the sine of the median
/// angle between the rays. `gate_px`: largest distance of an inlier from its epipolar line. Fails with TooFewSamples,
/// Mirrored, NoOverlap, or NoSolution if `progress` returns false.
Result<Rig, WandError> initial_extrinsics(const WandDetections& detections, const Rig& start, const Wand& wand,
                                          const WandSettings& settings, double gate_px, const Progress& progress);

/// The error Mirrored if the images of `camera` fit those of another camera only after a left-right reflection.
std::optional<WandError> check_mirrored(const WandDetections& detections, const Rig& start, std::size_t camera,
                                        const Wand& wand, const WandSettings& settings, double gate_px);

}  // namespace mocap::calibration
