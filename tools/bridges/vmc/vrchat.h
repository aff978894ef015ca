#pragma once

#include "bridges/vmc/osc.h"
#include "mocap_client.hpp"

namespace mocap::vmc {

/// Unity's Euler angles of a rotation in Unity's axes, degrees: the rotation is about z first, then x, then y, each
/// about an axis of the world. x is -90 to 90, y and z are -180 to 180. At x = +-90, z is 0.
mocap_vec3 unity_euler_deg(mocap_quat rotation);

/// Writes one subject of a frame as VRChat's OSC trackers: 1 hips, 2 chest, 3 and 4 the left and the right foot, 5 and
/// 6 the knees, 7 and 8 the elbows; and, if `with_head`, the head, to which VRChat aligns the space of the trackers.
/// The frame must be in Unity's axes. A knee and an elbow have the rotation of the segment above the joint. A lost bone
/// has no message, and without a tracked subject there is none at all: the protocol has no flag for it.
///
/// Source: https://docs.vrchat.com/docs/osc-trackers
void write_trackers(const ClientSubject* subject, bool with_head, OscBundles& into);

}  // namespace mocap::vmc
