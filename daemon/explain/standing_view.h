#pragma once

#include <cstdint>
#include <span>

#include "model/camera_model.h"
#include "model/points.h"
#include "model/skeleton.h"

namespace mocap::explain {

/// Whether the camera's image contains the position.
bool in_view(const CameraModel& camera, const WorldPoint& point);

/// Number of cameras whose images contain the position.
std::uint32_t cameras_with_view_of(const Rig& rig, const WorldPoint& point);

/// The largest number of markers that `views` cameras or more have in view if a person in rest pose stands on the floor
/// (z = 0) at the horizontal median of `points`, over all headings in steps of 45 degrees. All markers of the set if
/// there are no points. The body hides no marker.
std::uint32_t standing_markers_in_view(const Rig& rig, const MarkerSet& set, std::span<const WorldPoint> points,
                                       std::uint32_t views);

}  // namespace mocap::explain
