#pragma once

#include "bridges/vmc/osc.h"
#include "mocap_client.hpp"

namespace mocap::vmc {

/// Writes one subject of a frame in the VMC protocol (performer to marionette, version 2.7): /VMC/Ext/OK, /T, /Root/Pos
/// and a /Bone/Pos for each bone that has a name in Unity's HumanBodyBones. `time_s` is a time on the sender's clock.
/// The frame must be in Unity's axes. Local poses are relative to the nearest ancestor with such a name that is not
/// lost, because the receiver knows no other bones. Lost bones are omitted. Without a tracked subject, only /OK and /T
/// are written.
///
/// Source: https://protocol.vmc.info/marionette-spec
void write_frame(const ClientSubject* subject, float time_s, OscBundles& into);

}  // namespace mocap::vmc
