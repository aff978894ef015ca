#pragma once

#include "base/result.h"
#include "mocap/v1/description.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"

namespace mocap::wire {

/// Reads a message that may come from anybody. Fails with InvalidArgument, naming field, value and expectation, when
/// columns differ in length, a bound of model/bounds.h is passed, a number is not finite, a rotation is no unit
/// quaternion, an index points nowhere, or a thing stands twice. Values of enums that are not known are read as the
/// schema says. Covariances are not on the wire and keep their defaults; confidences come in steps of 0.01.
/// Local positions that a feed left out are zero until `put_at_rest_offsets`.
Result<Snapshot> decode(const v1::Snapshot& from);

/// Fills in the local positions of bones that `from`, of which `into` was read, left out: they are the description's.
void put_at_rest_offsets(const v1::Snapshot& from, const Description& description, Snapshot& into);

/// Also refuses another protocol than kProtocol and other conventions than ours.
Result<Description> decode(const v1::Description& from);

Result<Health> decode(const v1::Health& from);

}  // namespace mocap::wire
