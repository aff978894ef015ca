#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "model/timecode.h"

namespace mocap::exports {

/// Number of timecode frames since midnight.
std::int64_t frames_of(const Timecode& timecode) noexcept;

/// The timecode `frames` timecode frames after midnight, with the rate of `like`. Wraps around at midnight.
Timecode timecode_of(std::int64_t frames, const Timecode& like) noexcept;

/// Real frames per second: 1000/1001 of the nominal number if drop-frame, or if `fractional`.
double rate_hz(const Timecode& timecode, bool fractional) noexcept;

/// "01:02:03:04", or "01:02:03;04" if drop-frame.
std::string text_of(const Timecode& timecode);

/// Reads a text of `text_of`, with the rate of `like`; empty if the text is not a timecode of that rate.
std::optional<Timecode> parse_timecode(std::string_view text, const Timecode& like);

}  // namespace mocap::exports
