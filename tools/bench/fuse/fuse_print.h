#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "bench/fuse/fuse_bench.h"

namespace mocap::bench {

/// A JSON array with one object for each mode.
std::string fuse_json(std::span<const FuseBenchFigures> figures);

/// A table with times in us and ghosts in 1000 sets. With three sizes or more it includes the growth of the cost with
/// the number of blobs.
std::string fuse_table(std::span<const FuseBenchFigures> figures);

/// The exponent p of the fit median ~ blobs^p, by least squares of the logarithms over all figures of a mode; 1 is
/// linear. Empty with fewer than three different numbers of blobs.
std::optional<double> growth_exponent(std::span<const FuseBenchFigures> figures, std::string_view mode);

}  // namespace mocap::bench
