#pragma once

#include "stages/detect_kernels.h"

namespace mocap::stages {

/// Plain loops: for processors without any of the vector sets, and the oracle of those.
const DetectKernels& scalar_kernels();

}  // namespace mocap::stages
