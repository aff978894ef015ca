#pragma once

#include "base/result.h"
#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// Decodes a message from an untrusted sender.
///
/// Fails with InvalidArgument if columns differ in length, a bound of model/bounds.h is exceeded, a number is not
/// finite, a rotation is not a unit quaternion, an index is out of range, or a camera or subject occurs twice. The
/// message names field, value and expectation. Unknown enum values get the meaning that the schema documents.
/// Covariances are not transmitted and keep their defaults; confidences have steps of 0.01. Local positions that the
/// feed omits are zero until `put_at_rest_offsets`.
Result<Snapshot> decode(const v1::Snapshot& from);

/// Sets the local positions in `into` that the message `from` omits to the rest offsets of `description`. `into` must
/// be the result of `decode(from)`.
void put_at_rest_offsets(const v1::Snapshot& from, const Description& description, Snapshot& into);

/// Decodes a description from an untrusted sender. Fails with InvalidArgument, also if the protocol is not kProtocol or
/// the conventions (unit, handedness, up axis, quaternion order, clock) differ from those of the daemon.
Result<Description> decode(const v1::Description& from);

/// Decodes the counters of the daemon. Fails with InvalidArgument if there are more than kMaxCameras cameras.
Result<Health> decode(const v1::Health& from);

}  // namespace mocap::wire
