#pragma once

#include <cstdint>

#include "model/bounds.h"
#include "model/ids.h"

namespace mocap {

/// A set of cameras: bit i stands for CameraId{i}.
using CameraBits = std::uint64_t;
static_assert(kMaxCameras <= 64);

/// The set of one camera; empty if `camera` names none.
constexpr CameraBits bit_of(CameraId camera) { return camera.value < kMaxCameras ? CameraBits{1} << camera.value : 0; }

}  // namespace mocap
