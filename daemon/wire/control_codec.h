#pragma once

#include "base/result.h"
#include "mocap/v1/control.pb.h"
#include "model/control.h"

namespace mocap::wire {

/// Reads a request that may come from anybody. Fails with InvalidArgument, naming what is missing or out of range.
Result<ControlRequest> decode(const v1::Request& from);

/// What a client sends.
v1::Request encode(const ControlRequest& from);

/// All but the id.
v1::Answer encode(const ControlAnswer& from);

}  // namespace mocap::wire
