#pragma once

#include "bridges/lib/receiver_axes.h"
#include "bridges/natnet/settings.h"

namespace mocap::natnet {

/// The axes that a client asked for.
inline bridge::Axes axes_of(UpAxis up) { return up == UpAxis::Y ? bridge::natnet_y_up() : bridge::natnet_z_up(); }

}  // namespace mocap::natnet
