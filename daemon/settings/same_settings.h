#pragma once

#include <string_view>

#include "settings/daemon_settings.h"

namespace mocap::settings {

/// Whether two configurations have equal values under all keys of a section, such as "label".
bool same_section(const DaemonSettings& one, const DaemonSettings& other, std::string_view section);

/// Whether the feed, or the control endpoint, is the same one: addresses, keys, limits.
bool same_feed(const DaemonSettings& one, const DaemonSettings& other);
bool same_control(const DaemonSettings& one, const DaemonSettings& other);

/// Whether a camera is the same device with the same settings; the detection may differ. A simulated camera is another
/// one if its lens, its pose or its subject differs.
bool same_device(const DaemonSettings& one, const DaemonSettings& other, CameraId camera);
/// Whether the images of a camera are processed alike: detection, masks, size, 2D tracks, and its thread.
bool same_processing(const DaemonSettings& one, const DaemonSettings& other, CameraId camera);

/// Whether both rigs have the same cameras in the same order, with equal lenses and poses; masks may differ.
bool same_rig(const Rig& one, const Rig& other);
/// Whether most cameras that both rigs have stand where they stood: a point that one of them sees 4 m away moved by at
/// most 20 mm, less than the gate of a marker. Then the world frame is the same.
bool same_world(const Rig& one, const Rig& other);

/// The subject of `before` that has the name and the definition of subject `now` of `after`; names nothing if there is
/// none. A body that the daemon fitted and keeps in a file is no part of the definition.
SubjectId same_subject(const DaemonSettings& before, const DaemonSettings& after, SubjectId now);

}  // namespace mocap::settings
