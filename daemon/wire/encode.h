#pragma once

#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// What a feed of this schema calls itself.
inline constexpr const char* kProtocol = "mocap.v1";

/// Writes a snapshot into a message. The same message given again and again keeps its memory: once it has held the
/// largest snapshot, nothing is allocated. Positions and rotations become single precision, confidences whole percents;
/// covariances stay behind. `sequence` and `utc_minus_host_ns` are cleared: they belong to the sender. A marker or bone
/// that is Lost has zeros (and the identity) for the numbers that mean nothing.
void encode(const Snapshot& from, v1::Snapshot& into);

/// With the conventions of the whole feed. Rare; allocates.
v1::Description encode(const Description& from);

/// Stages that nothing passed are left out. The same message given again and again keeps its memory.
void encode(const Health& from, v1::Health& into);

}  // namespace mocap::wire
