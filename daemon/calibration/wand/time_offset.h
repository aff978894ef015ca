#pragma once

#include <optional>
#include <span>
#include <vector>

#include "calibration/bundle.h"
#include "calibration/wand/wand_detections.h"

namespace mocap::calibration {

/// The part of a camera's exposure time that its time stamps do not report.
struct TimeOffset {
  double late_s = 0.0;   ///< positive: the camera exposes after the other cameras
  double sigma_s = 0.0;  ///< standard deviation; infinite if the samples do not determine the offset
};

/// Estimates the time offset of each camera against the others, together with a correction of its pose.
///
/// The other cameras triangulate the wand; a late camera sees each marker displaced along its image motion. The pose of
/// the camera is an unknown of the same least-squares problem, because a pose that was estimated from late images hides
/// a part of the offset. Requires wand poses in `bundle` that are accurate to `gate_px`.
std::vector<TimeOffset> estimate_time_offsets(const WandDetections& detections, const Bundle& bundle, double gate_px);

/// Whether an offset that is too large would be seen: 1.5 ms are at least six standard deviations.
bool is_determined(const TimeOffset& offset);

/// The camera whose offset exceeds its limit most, as a ratio; nothing if no offset exceeds 1.5 ms and six of its
/// standard deviations.
std::optional<std::size_t> unsynchronised_camera(std::span<const TimeOffset> offsets);

}  // namespace mocap::calibration
