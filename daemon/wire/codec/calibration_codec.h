#pragma once

#include <vector>

#include "base/result.h"
#include "mocap/v1/control.pb.h"
#include "model/calibration/calibration_order.h"
#include "model/calibration/calibration_report.h"

namespace mocap::wire {

/// Decodes a request from an untrusted client. Fails with InvalidArgument; the message names the field that is missing
/// or out of range.
Result<CalibrationOrder> decode(const v1::CalibrationRequest& from);

v1::CalibrationRequest encode(const CalibrationOrder& from);
v1::Calibration encode(const CalibrationReport& from);
v1::RigList encode(const std::vector<KeptRig>& from);

}  // namespace mocap::wire
