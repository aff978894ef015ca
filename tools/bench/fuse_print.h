#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "fuse_bench.h"

namespace mocap::bench {

/// A JSON array, one object a mode.
std::string fuse_json(std::span<const FuseBenchFigures> figures);

/// A table, times in us; ghosts in a thousand sets. Of three sizes or more it says how the cost grows with the blobs.
std::string fuse_table(std::span<const FuseBenchFigures> figures);

/// The power of the number of blobs with which the median grows, by least squares of the logarithms over all figures of
/// a mode: 1 is linear. Nothing where they have fewer than three numbers of blobs, which tell no growth.
std::optional<double> growth_exponent(std::span<const FuseBenchFigures> figures, std::string_view mode);

}  // namespace mocap::bench
