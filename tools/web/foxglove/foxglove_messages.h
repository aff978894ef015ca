#pragma once

#include <cstdint>
#include <string>

#include "foxglove/foxglove.pb.h"
#include "mocap/v1/description.pb.h"
#include "mocap/v1/preview.pb.h"
#include "mocap/v1/snapshot.pb.h"

namespace mocap::web {

/// The frame of all positions: z up, floor at z = 0.
inline constexpr const char* kWorldFrame = "world";

/// The poses of all bones in the world, at the exposure; the frame of a bone is SUBJECT/BONE. Bones without a pose are
/// left out. Empty if `snapshot` refers to another version of the description.
foxglove::FrameTransforms bones_of(const v1::Snapshot& snapshot, const v1::Description& description);

/// The markers (measured: their colour, filled: translucent; without a label: grey), bones as lines, and names of all
/// subjects. An entity disappears one second after its exposure, so that lost data does not look live. Empty if
/// `snapshot` refers to another version of the description.
foxglove::SceneUpdate scene_of(const v1::Snapshot& snapshot, const v1::Description& description);

/// The poses of all cameras in the world; the frame of a camera is camera/NAME. `utc_ns`: since the Unix epoch.
foxglove::FrameTransforms cameras_of(const v1::Description& description, std::int64_t utc_ns);

/// The image of the camera `name`.
foxglove::CompressedImage image_of(const v1::Preview& preview, const std::string& name, std::int64_t utc_minus_host_ns);

/// Middle of the exposure, ns since the Unix epoch; on the host's clock if the offset is unknown.
std::int64_t exposed_utc_ns(const v1::Snapshot& snapshot);

}  // namespace mocap::web
