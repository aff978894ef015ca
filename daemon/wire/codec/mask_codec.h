#pragma once

#include <vector>

#include "base/result.h"
#include "mocap/v1/control.pb.h"
#include "model/control.h"

namespace mocap::wire {

/// Decodes a request from an untrusted client. Fails with InvalidArgument; the message names the field that is missing
/// or out of range.
Result<ControlRequest> decode(const v1::MaskRequest& from);

/// `from.action` is one of those about masks.
v1::MaskRequest encode_mask_request(const ControlRequest& from);
v1::MaskList encode(const std::vector<CameraMasks>& from);

}  // namespace mocap::wire
