#pragma once

#include "axes.h"

namespace mocap::bridge {

using client::Axes;

/// NatNet, up axis Y: right-handed, x left, y up, z forward, m, as a character in T-pose faces +z.
inline Axes natnet_y_up() { return Axes(MOCAP_AXES_GLTF); }
/// NatNet, up axis Z: the former turned by +90 degrees about x: x left, y backward, z up.
inline Axes natnet_z_up() { return Axes({{1, 0, 2}, {1.0F, -1.0F, 1.0F}, 1.0F, 1.0F}); }
/// VRPN: the axes of the feed, as ROS has them: x forward, y left, z up, m.
inline Axes vrpn_axes() { return Axes(MOCAP_AXES_MOCAP); }
/// Rokoko: Unity's axes: left-handed, x right, y up, z forward, m.
inline Axes rokoko_axes() { return Axes(MOCAP_AXES_UNITY); }

}  // namespace mocap::bridge
