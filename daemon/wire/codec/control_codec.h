#pragma once

#include "base/result.h"
#include "mocap/v1/control.pb.h"
#include "model/control.h"

namespace mocap::wire {

/// Decodes a request from an untrusted client. Fails with InvalidArgument; the message names the field that is missing
/// or out of range.
Result<ControlRequest> decode(const v1::Request& from);

/// Encodes a request. For clients: tools and tests.
v1::Request encode(const ControlRequest& from);

/// Encodes an answer without its `id`: the caller copies the id of the request.
v1::Answer encode(const ControlAnswer& from);

}  // namespace mocap::wire
