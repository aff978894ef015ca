#pragma once

#include <cstdint>

#include "base/result.h"

namespace mocap::bench {

/// A port of this machine's loopback address at which nobody listens now, neither by TCP nor by UDP. Fails with Io.
Result<std::uint16_t> free_port();

}  // namespace mocap::bench
