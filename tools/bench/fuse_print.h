#pragma once

#include <span>
#include <string>

#include "fuse_bench.h"

namespace mocap::bench {

/// A JSON array, one object a mode.
std::string fuse_json(std::span<const FuseBenchFigures> figures);

/// A table, times in us; ghosts in a thousand sets.
std::string fuse_table(std::span<const FuseBenchFigures> figures);

}  // namespace mocap::bench
