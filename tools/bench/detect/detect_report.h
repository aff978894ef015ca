#pragma once

#include "bench/detect/detect_bench.h"

namespace mocap::bench {

/// Runs the detection bench and prints its figures as a table or as one JSON object. Returns the exit code.
int detect(const simworld::DetectSceneSettings& settings, bool json);

}  // namespace mocap::bench
