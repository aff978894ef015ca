#pragma once

#include "mocap_client.hpp"
#include "osc.h"

namespace mocap::vmc {

/// Says one subject of a frame in the VMC protocol (performer to marionette, version 2.7): /VMC/Ext/OK, /T, /Root/Pos
/// and a /Bone/Pos for each bone that has a name in Unity's HumanBodyBones. `time_s` runs on the sender's own clock.
///
/// The frame must come in Unity's axes. Local poses are told from the nearest bone above that has such a name, since
/// the receiver knows no other. Without a tracked subject, or with bones of it lost, only what is known is said.
///
/// Source: https://protocol.vmc.info/marionette-spec
void say_frame(const ClientSubject* subject, float time_s, OscBundles& into);

}  // namespace mocap::vmc
