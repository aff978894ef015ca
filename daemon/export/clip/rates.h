#pragma once

#include <optional>
#include <string_view>

#include "base/rational_rate.h"

namespace mocap::exports {

/// The fraction of a rate: 30000/1001 for 29.97, otherwise in steps of 0.001 Hz. `hz` is more than 0.
Rate rate_of(double hz);

/// Reads "120", "29.97" or "30000/1001"; empty if the text is no rate between 1 and 10000 Hz.
std::optional<Rate> parse_rate(std::string_view text);

}  // namespace mocap::exports
